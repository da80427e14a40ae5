"""Makes nav2_msgs of its definition, which no wheel of ROS brings, by the generators that the wheels bring.

Run by ros/test in the environment of the wheels. What it makes lies there as the wheels' own messages do.
"""

import os
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

import numpy

PACKAGE, FILE = "nav2_msgs", Path("action/NavigateToPose.action")
FOLDER = Path(__file__).parent.absolute()
ENVIRONMENT = Path(sys.prefix)
os.environ["AMENT_PREFIX_PATH"] = str(ENVIRONMENT)
SITE = Path(sysconfig.get_paths()["purelib"])
MODULE = SITE / PACKAGE / f"{PACKAGE}_s__rosidl_typesupport_c{sysconfig.get_config_var('EXT_SUFFIX')}"
# What messages tell of themselves: to the middleware as bytes, and to whoever looks at them as fields.
SUPPORTS = ["rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"]
USED = ["geometry_msgs", "std_msgs", "builtin_interfaces", "action_msgs", "unique_identifier_msgs", "service_msgs"]


def generate(out: Path) -> None:
    """Writes sources, each kind into a folder of its own: some have the same names."""
    from rosidl_adapter.action import convert_action_to_idl
    from rosidl_generator_c.cli import GenerateC
    from rosidl_generator_py.cli import GeneratePython
    from rosidl_generator_type_description.cli import HashTypeDescription
    from rosidl_typesupport_c.cli import GenerateCTypesupport
    from rosidl_typesupport_fastrtps_c.cli import GenerateFastRTPSCTypesupport
    from rosidl_typesupport_introspection_c.cli import GenerateIntrospectionCTypesupport

    idl = out / "idl" / FILE.with_suffix(".idl")
    idl.parent.mkdir(parents=True)
    convert_action_to_idl(FOLDER, PACKAGE, FILE, idl.parent)
    files = [f"{out / 'idl'}:{FILE.with_suffix('.idl')}"]
    hashes = HashTypeDescription("hash").generate_type_hashes(
        PACKAGE, files, [str(ENVIRONMENT / "share")], out / "idl"
    )
    GenerateC("c").generate(PACKAGE, files, [], out / "c" / PACKAGE, [str(path) for path in hashes])
    GenerateFastRTPSCTypesupport("bytes").generate(PACKAGE, files, [], out / "bytes" / PACKAGE)
    GenerateIntrospectionCTypesupport("fields").generate(PACKAGE, files, [], out / "fields" / PACKAGE)
    GenerateCTypesupport("both", typesupport_implementations=SUPPORTS).generate(
        PACKAGE, files, [], out / "both" / PACKAGE
    )
    GeneratePython("python", typesupport_implementations=["rosidl_typesupport_c"]).generate(
        PACKAGE, files, [], out / "python" / PACKAGE
    )


def build(out: Path) -> None:
    include, libraries = ENVIRONMENT / "include", ENVIRONMENT / "lib"
    folders = [*(out / part for part in ("c", "bytes", "fields", "both")), include, *include.iterdir()]
    folders += [sysconfig.get_paths()["include"], numpy.get_include()]
    used = [path for name in USED for path in libraries.glob(f"lib{name}__*.so") if path.stem.endswith(("_c", "_py"))]
    used += [*libraries.glob("librosidl_*.so"), libraries / "libfastcdr.so", libraries / "librcutils.so"]

    def link(made: Path, parts, own=()) -> Path:
        sources = [path for part in parts for path in (out / part).rglob("*.c*") if path.suffix in (".c", ".cpp")]
        words = ["gcc", "-shared", "-fPIC", "-O0", "-w", *(f"-I{folder}" for folder in folders), *sources]
        words += [f"-Wl,-soname,{made.name}", f"-Wl,-rpath,{libraries}", "-Wl,--no-as-needed", *own]
        subprocess.run([*words, "-Wl,--as-needed", *used, "-lstdc++", "-o", made], check=True)
        return made

    # Found by their names, once the module has brought them in.
    own = [link(libraries / f"lib{PACKAGE}__{SUPPORTS[0]}.so", ["c", "bytes"])]
    own += [link(libraries / f"lib{PACKAGE}__{SUPPORTS[1]}.so", ["fields"], own)]
    for path in (out / "python").rglob("*.py"):
        place = SITE / path.relative_to(out / "python")
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(path.read_text())
    (SITE / PACKAGE / "__init__.py").touch()
    link(MODULE, ["both", "python"], own)


if __name__ == "__main__":
    newest_s = max(path.stat().st_mtime for path in (FOLDER / FILE, Path(__file__)))
    if not (MODULE.exists() and MODULE.stat().st_mtime > newest_s):
        with tempfile.TemporaryDirectory() as folder:
            generate(Path(folder))
            build(Path(folder))
