"""The bytes that the Rust tests read are those of rclpy."""

from rclpy.serialization import deserialize_message, serialize_message
from recorded import FOLDER, messages


def test_what_the_rust_tests_read_is_what_rclpy_writes():
    for name, message in messages().items():
        recorded = (FOLDER / f"{name}.cdr").read_bytes()
        # Bytes between numbers differ from time to time.
        assert len(recorded) == len(serialize_message(message)), name
        assert deserialize_message(recorded, type(message)) == message, name
    assert {path.stem for path in FOLDER.iterdir()} == set(messages())
