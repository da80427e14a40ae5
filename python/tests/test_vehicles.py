"""Vehicles, models and settings: names, files, texts, dicts, and what is said of those that cannot be."""

import copy
import dataclasses
import pickle

import numpy as np
import pytest
import surefoot

TEXT = """
wheelbase_m = 0.18

[limits]
speed_max_mps = 1.5
reverse_speed_max_mps = 0.75
steering_max_rad = 0.5
steering_rate_max_radps = 3.0
acceleration_max_mps2 = 2.0
lateral_acceleration_max_mps2 = 4.0
roll_max_rad = 0.5
pitch_max_rad = 0.7

[[effects]]
id = "steer_lag"
time_constant_s = 0.15
"""


def test_every_shipped_vehicle_is_found_by_its_name():
    assert "rc_car" in surefoot.Vehicle.SHIPPED
    for name in surefoot.Vehicle.SHIPPED:
        vehicle = surefoot.Vehicle(name)
        assert vehicle.name == name
        assert vehicle.to_dict()["limits"]["speed_max_mps"] == vehicle.model().to_dict()["limits"]["speed_max_mps"]
    assert surefoot.SkidSteerVehicle("warthog").model().to_dict()["limits"]["yaw_rate_max_radps"] > 0.0


def test_text_file_and_dict_make_the_same_model(tmp_path):
    path = tmp_path / "model.toml"
    path.write_text(TEXT)
    of_text, of_file = surefoot.Model.from_toml(TEXT), surefoot.Model(path)
    assert of_text == of_file == surefoot.Model.from_dict(of_text.to_dict())
    assert of_text.to_dict()["effects"] == [{"id": "steer_lag", "time_constant_s": 0.15}]
    faster = copy.deepcopy(of_text.to_dict())
    faster["limits"]["speed_max_mps"] = np.float32(2.0)
    assert surefoot.Model.from_dict(faster).to_dict()["limits"]["speed_max_mps"] == 2.0
    assert surefoot.Model.from_dict(faster) != of_text


@dataclasses.dataclass
class Limits:
    speed_max_mps: float = 1.5
    reverse_speed_max_mps: float = 0.75
    steering_max_rad: float = 0.5
    steering_rate_max_radps: float = 3.0
    acceleration_max_mps2: float = 2.0
    lateral_acceleration_max_mps2: float = 4.0
    roll_max_rad: float = 0.5
    pitch_max_rad: float = 0.7


@dataclasses.dataclass(frozen=True, slots=True)
class SteerLag:
    id: str = "steer_lag"
    time_constant_s: float = 0.15


@dataclasses.dataclass
class Bicycle:
    wheelbase_m: float = 0.18
    limits: object = dataclasses.field(default_factory=Limits)
    effects: list[SteerLag] | None = None


def test_a_dataclass_makes_what_its_file_makes():
    lagging = surefoot.Model.from_dict(Bicycle(effects=[SteerLag()]))
    assert lagging == surefoot.Model.from_toml(TEXT)
    # What is None stands in no file.
    assert surefoot.Model.from_dict(Bicycle()).to_dict().get("effects", []) == []
    shipped = surefoot.Vehicle("rc_car")
    description = shipped.to_dict()
    vehicle = dataclasses.make_dataclass("Car", description)(**description)
    assert surefoot.Vehicle.from_dict(vehicle) == shipped

    @dataclasses.dataclass
    class Changes:
        controller: dict[str, int]

    settings = surefoot.settings_for(shipped, Changes({"n_rollouts": 256}))
    assert settings == surefoot.settings_for(shipped, {"controller": {"n_rollouts": 256}})


def test_a_refused_dataclass_is_told_by_its_path():
    with pytest.raises(ValueError) as refusal:
        surefoot.Model.from_dict(Bicycle(limits=Limits(roll_max_rad=-1.0)))
    assert str(refusal.value).startswith("model: limits.roll_max_rad: expected "), refusal.value
    with pytest.raises(TypeError, match="^model: expected a dict or a dataclass, found type$"):
        surefoot.Model.from_dict(Bicycle)
    with pytest.raises(TypeError, match="^model: expected a dict or a dataclass, found int$"):
        surefoot.Model.from_dict(3)
    endless = Bicycle()
    endless.limits = endless
    with pytest.raises(ValueError, match="within each other"):
        surefoot.Model.from_dict(endless)


@pytest.mark.parametrize(
    "thing",
    [
        surefoot.Vehicle("rc_car"),
        surefoot.SkidSteerVehicle("warthog"),
        surefoot.Model.from_toml(TEXT),
        surefoot.SkidSteerVehicle("warthog").model(),
    ],
    ids=repr,
)
def test_descriptions_can_be_pickled(thing):
    assert pickle.loads(pickle.dumps(thing)) == thing


def test_a_refused_text_is_told_as_on_the_command_line():
    with pytest.raises(ValueError) as refusal:
        surefoot.Model.from_toml(TEXT.replace("0.18", "0"), name="mine.toml")
    assert str(refusal.value) == "mine.toml:2: wheelbase_m: expected a finite number > 0, found 0"
    with pytest.raises(ValueError, match=r"^mine\.toml:3: expected TOML, found: "):
        surefoot.Model.from_toml("a = 1\nb = 2\n[c", name="mine.toml")


def test_a_missing_file_is_an_error_of_the_file_system_with_the_names_that_exist():
    with pytest.raises(FileNotFoundError, match=r"^no_such: expected a readable .*shipped vehicles: .*rc_car"):
        surefoot.Vehicle("no_such")


def test_a_refused_dict_is_told_by_its_path():
    description = surefoot.Vehicle("rc_car").to_dict()
    description["geometry"]["track_m"] = -1.0
    with pytest.raises(ValueError) as refusal:
        surefoot.Vehicle.from_dict(description)
    assert str(refusal.value) == "vehicle: geometry.track_m: expected a finite number > 0, found -1"
    description["geometry"]["track_m"] = np.zeros(3)
    with pytest.raises(TypeError) as refusal:
        surefoot.Vehicle.from_dict(description)
    assert str(refusal.value) == (
        "vehicle: geometry.track_m: expected a number, a bool, a string, a list, a dict or a dataclass, found ndarray"
    )
    with pytest.raises(ValueError, match=r"limits\.speed_max_mps: expected a value, found no such key"):
        broken = surefoot.Model.from_toml(TEXT).to_dict()
        del broken["limits"]["speed_max_mps"]
        surefoot.Model.from_dict(broken)


def test_a_dict_without_end_is_refused():
    endless = {}
    endless["limits"] = endless
    with pytest.raises(ValueError, match="at most 16 dicts and lists within each other, found more"):
        surefoot.Model.from_dict(endless)
    endless = []
    endless.append(endless)
    with pytest.raises(ValueError, match="within each other"):
        surefoot.Model.from_dict({"effects": endless})


def test_settings_fit_the_vehicle_and_take_what_differs():
    vehicle = surefoot.Vehicle("rc_car")
    fitting = surefoot.settings_for(vehicle)
    changed = surefoot.settings_for(vehicle, {"prior": {"evidence": 20}, "controller": {"n_rollouts": 256}})
    assert (changed["prior"]["evidence"], changed["controller"]["n_rollouts"]) == (20.0, 256)
    changed["prior"]["evidence"], changed["controller"]["n_rollouts"] = (
        fitting["prior"]["evidence"],
        fitting["controller"]["n_rollouts"],
    )
    assert changed == fitting
    # The cells of a larger vehicle are larger.
    larger = surefoot.settings_for(surefoot.Vehicle("pietra_full_size"))
    assert larger["elevation"]["resolution_m"] > 2.0 * fitting["elevation"]["resolution_m"]


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"pryor": {}}, "changes: pryor: expected one of "),
        ({"prior": {"evidence": "much"}}, "evidence"),
        ({"prior": {"uniform_weight": 1.1}}, "uniform_weight: expected a number from 0 to 1, found 1.1"),
        ({"risk_map": {"n_rows": 2}}, "risk_map.n_rows: expected a whole number from 3 to 4096, found 2"),
        ({"controller": {"n_rollouts": 100}}, "n_rollouts: expected a multiple of 64, found 100"),
        ({"elevation": {"resolution_m": float("nan")}}, "resolution_m: expected a finite number > 0, found NaN"),
        ("prior = 3", "changes:1: prior: "),
    ],
)
def test_settings_that_cannot_be_are_refused(changes, told):
    with pytest.raises(ValueError) as refusal:
        surefoot.settings_for(surefoot.Vehicle("rc_car"), changes)
    assert told in str(refusal.value)
