"""Arrays in and out: whose memory they are, and what is said of those that are refused."""

import pickle

import ground
import numpy as np
import pytest
import surefoot


def address(array):
    return array.__array_interface__["data"][0]


def test_risks_without_gaps_are_read_where_they_lie():
    risks = ground.level_risks()
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.2)
    assert address(risk_map.risks) == address(risks)
    assert risk_map.risks.shape == risks.shape
    risks[40, 60, 0, 0] = 0.25
    # The middle of row 40, column 60 and of the first of eight yaws.
    assert risk_map.risk_at((60.5 * 0.2, 40.5 * 0.2, 0.3))[0] == 0.25


def test_a_map_reads_an_array_that_may_not_be_written():
    risks = ground.level_risks()
    risks.flags.writeable = False
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.2)
    assert address(risk_map.risks) == address(risks)


@pytest.mark.parametrize("layout", ["fortran", "strided", "reversed", "misaligned"])
def test_risks_of_another_layout_are_copied_with_the_same_values(layout):
    plain = ground.level_risks(n_rows=7, n_cols=9)
    plain[1:-1, 1:-1] = np.random.default_rng(1).uniform(0.1, 1.0, (5, 7, 8, 4))
    if layout == "fortran":
        risks = np.asfortranarray(plain)
    elif layout == "strided":
        risks = np.repeat(plain, 2, axis=1)[:, ::2]
    elif layout == "reversed":
        risks = plain[::-1].copy()[::-1]
    else:
        memory = np.zeros(plain.nbytes + 1, np.uint8)[1:]
        risks = memory.view(np.float32).reshape(plain.shape)
        risks[...] = plain
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.2)
    assert not np.shares_memory(risk_map.risks, risks)
    np.testing.assert_array_equal(risk_map.risks, plain)


def test_an_open_ring_is_closed_in_a_copy():
    risks = np.full((5, 6, 4, 4), 0.5, np.float32)
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.2)
    assert not np.shares_memory(risk_map.risks, risks) and (risks == 0.5).all()
    assert (risk_map.risks[1:-1, 1:-1] == 0.5).all()
    ring = np.ones((5, 6), bool)
    ring[1:-1, 1:-1] = False
    assert (risk_map.risks[ring] == 0.0).all()


def test_what_a_map_hands_out_is_its_own_memory_and_cannot_be_written():
    risk_map = surefoot.RiskMap.from_arrays(np.full((5, 6, 4, 4), 0.5, np.float32), 0.2)
    first, second = risk_map.risks, risk_map.risks
    assert address(first) == address(second)
    with pytest.raises(ValueError, match="read-only"):
        first[2, 2] = 0.0
    # Whoever changes the type or the shape of a view changes nobody else's.
    first.shape = (-1,)
    assert second.shape == risk_map.risks.shape == (5, 6, 4, 4)
    assert risk_map.risk_at((0.5, 0.5, 0.1))[0] == 0.5


def test_a_map_outlives_the_names_of_its_arrays():
    risk_map = surefoot.RiskMap.from_arrays(ground.level_risks(), 0.2)
    risks = risk_map.risks
    del risk_map
    assert float(risks[40, 60, 0, 0]) == np.float32(0.8)


def test_the_ground_under_a_map_comes_back():
    rng = np.random.default_rng(2)
    gradient = rng.normal(size=(5, 6, 2)).astype(np.float32)
    terrain_class = rng.integers(0, 4, (5, 6), np.uint8)
    flags = rng.integers(0, 8, (5, 6), np.uint8)
    risks = np.full((5, 6, 4, 4), 0.5, np.float32)
    risk_map = surefoot.RiskMap.from_arrays(
        risks, 0.5, origin=(-7, 3), gradient=gradient, terrain_class=terrain_class, flags=flags
    )
    np.testing.assert_array_equal(risk_map.gradient, gradient)
    np.testing.assert_array_equal(risk_map.terrain_class, terrain_class)
    np.testing.assert_array_equal(risk_map.flags, flags)
    assert (risk_map.shape, risk_map.resolution_m, risk_map.origin) == ((5, 6, 4), 0.5, (-7, 3))


def root(array):
    """Whoever keeps the memory of an array."""
    while isinstance(array, np.ndarray) and array.base is not None:
        array = array.base
    return array


def test_results_are_the_memory_that_they_were_computed_into():
    risk_map = ground.level_map()
    controller = surefoot.Mppi(surefoot.Vehicle("rc_car").model(), {"n_rollouts": 64})
    controller.decide(np.zeros(5), risk_map, (5.0, 0.0))
    rollouts = controller.rollouts(risk_map)
    for name in ("states", "costs_s", "weights"):
        array = getattr(rollouts, name)
        # NumPy owns what was copied into an array of its own.
        assert not isinstance(root(array), np.ndarray), f"{name} was copied"
        assert address(getattr(rollouts, name)) == address(array), f"{name} is copied at every look"
    for array in (controller.plan, controller.trajectory(risk_map)):
        assert not isinstance(root(array), np.ndarray)


def with_risk(place, value):
    risks = ground.level_risks(n_rows=5, n_cols=6)
    risks[place] = value
    return risks


@pytest.mark.parametrize(
    ("risks", "error", "told"),
    [
        (None, TypeError, "risks: expected an array of float32 with axes (row, col, yaw, 4), found None"),
        ([[1.0]], TypeError, "found list"),
        (np.zeros((5, 6, 4, 4)), TypeError, "found one of float64"),
        (np.zeros((5, 6, 4, 4), ">f4"), TypeError, "found one of >f4"),
        (np.zeros((5, 6, 4, 4), object), TypeError, "found one of object"),
        (np.zeros((5, 6, 4), np.float32), ValueError, "found shape (5, 6, 4)"),
        (np.zeros((5, 6, 4, 3), np.float32), ValueError, "expected shape (5, 6, 4, 4), found shape (5, 6, 4, 3)"),
        (np.zeros((5, 6, 0, 4), np.float32), ValueError, "one yaw at the least"),
        (np.zeros((2, 6, 4, 4), np.float32), ValueError, "at least 3 x 3"),
        (with_risk((2, 3, 1, 0), np.nan), ValueError, "risks[2, 3, 1, 0]: expected a number from 0 to 1, found NaN"),
        (with_risk((2, 3, 1, 1), 1.5), ValueError, "risks[2, 3, 1, 1]: expected a number from 0 to 1, found 1.5"),
        (with_risk((1, 1, 0, 2), -0.1), ValueError, "risks[1, 1, 0, 2]: expected a finite number >= 0, found -0.1"),
        (with_risk((1, 1, 0, 3), np.inf), ValueError, "risks[1, 1, 0, 3]: expected a finite number >= 0, found inf"),
    ],
)
def test_risks_that_cannot_be_are_refused(risks, error, told):
    with pytest.raises(error) as refusal:
        surefoot.RiskMap.from_arrays(risks, 0.2)
    assert told in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"resolution_m": 0.0}, "resolution_m: expected a length from 0.001 to 1000 m, found 0"),
        ({"resolution_m": float("nan")}, "found NaN"),
        ({"resolution_m": -0.2}, "found -0.2"),
        ({"origin": (1 << 41, 0)}, "origin: expected cells within"),
        ({"gradient": np.full((5, 6, 2), np.inf, np.float32)}, "gradient[0, 0]: expected two finite numbers"),
        ({"gradient": np.zeros((5, 6, 3), np.float32)}, "expected shape (5, 6, 2), found shape (5, 6, 3)"),
        ({"terrain_class": np.full((5, 6), 4, np.uint8)}, "terrain_class[0, 0]: expected a class from 0 to 3, found 4"),
        ({"flags": np.full((5, 6), 9, np.uint8)}, "flags[0, 0]: expected a sum of 1, 2 and 4, found 9"),
        ({"flags": np.zeros((6, 5), np.uint8)}, "flags: expected shape (5, 6), found shape (6, 5)"),
    ],
)
def test_a_map_that_cannot_be_is_refused(changes, told):
    arguments = {"risks": ground.level_risks(n_rows=5, n_cols=6), "resolution_m": 0.2} | changes
    with pytest.raises(ValueError) as refusal:
        surefoot.RiskMap.from_arrays(**arguments)
    assert told in str(refusal.value)


def test_values_written_behind_the_maps_back_stop_the_vehicle_and_harm_nobody():
    risks = ground.level_risks()
    risk_map = surefoot.RiskMap.from_arrays(risks, 0.2, origin=(-60, -40))
    controller = surefoot.Mppi(surefoot.Vehicle("rc_car").model())
    risks[1:-1, 1:-1] = np.nan
    decision = controller.decide(np.zeros(5), risk_map, (5.0, 0.0))
    assert (decision.kind, decision.command[0]) == ("stop", 0.0)


def test_surfaces_come_back_and_holes_stay_holes():
    rng = np.random.default_rng(3)
    height_m = rng.normal(size=(6, 7)).astype(np.float32)
    height_m[2, 3] = np.nan
    terrain_class = rng.integers(0, 4, (6, 7), np.uint8)
    vegetation_height_m = rng.uniform(0.0, 0.5, (6, 7)).astype(np.float32)
    surface = surefoot.Surface.from_arrays(
        height_m, 0.25, origin=(4, -9), terrain_class=terrain_class, vegetation_height_m=vegetation_height_m
    )
    known = ~np.isnan(height_m)
    np.testing.assert_array_equal(surface.height_m, height_m)
    np.testing.assert_array_equal(surface.terrain_class[known], terrain_class[known])
    np.testing.assert_array_equal(surface.vegetation_height_m[known], vegetation_height_m[known])
    np.testing.assert_array_equal(surface.knowledge, np.where(known, 2, 0))
    np.testing.assert_array_equal(surface.class_probability.argmax(axis=2)[known], terrain_class[known])
    assert surface.height_variance_m2[2, 3] == np.inf
    assert (surface.shape, surface.resolution_m, surface.origin) == ((6, 7), 0.25, (4, -9))


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"height_m": np.full((4, 4), 1e6, np.float32)}, "height_m[0, 0]: expected a height from -1e5 to 1e5 m"),
        ({"height_m": np.full((4, 4), -np.inf, np.float32)}, "found -inf"),
        ({"vegetation_height_m": np.full((4, 4), -1, np.float32)}, "vegetation_height_m[0, 0]"),
        ({"height_variance_m2": np.full((4, 4), np.nan, np.float32)}, "height_variance_m2[0, 0]"),
        ({"terrain_class": np.full((4, 4), 200, np.uint8)}, "found 200"),
    ],
)
def test_ground_that_cannot_be_is_refused(changes, told):
    arguments = {"height_m": np.zeros((4, 4), np.float32), "resolution_m": 0.2} | changes
    with pytest.raises(ValueError) as refusal:
        surefoot.Surface.from_arrays(**arguments)
    assert told in str(refusal.value)


def fused_surface():
    """A slope seen by one scan with a bush and a wall on it: measured, filled in and unknown ground."""
    rng = np.random.default_rng(3)
    points = rng.uniform([-6.0, -6.0, 0.0], [6.0, 6.0, 0.0], (6000, 3)).astype(np.float32)
    points[:, 2] = 0.1 * points[:, 0]
    terrain_class = np.zeros(6000, np.uint8)
    is_bush = (np.abs(points[:, 0] - 2.0) < 1.0) & (np.abs(points[:, 1]) < 1.0)
    is_wall = points[:, 0] > 5.0
    points[is_bush, 2] += rng.uniform(0.0, 0.6, is_bush.sum())
    points[is_wall, 2] += rng.uniform(0.0, 2.0, is_wall.sum())
    terrain_class[is_bush], terrain_class[is_wall] = 2, 3
    elevation = surefoot.ElevationMap(surefoot.settings_for(surefoot.Vehicle("pietra_full_size"))["elevation"])
    elevation.fuse(points, (0.0, 0.0, 1.0, 0.0, 0.0, 0.0), terrain_class=terrain_class)
    return elevation.surface()


SURFACE_LAYERS = [
    "height_m", "height_variance_m2", "vegetation_height_m", "terrain_class", "class_probability", "knowledge",
]  # fmt: skip


def test_maps_can_be_pickled():
    surface = fused_surface()
    assert set(np.unique(surface.knowledge)) == {0, 1, 2}
    copy = pickle.loads(pickle.dumps(surface))
    assert (copy.shape, copy.resolution_m, copy.origin) == (surface.shape, surface.resolution_m, surface.origin)
    for layer in SURFACE_LAYERS:
        assert np.array_equal(getattr(copy, layer), getattr(surface, layer), equal_nan=True), layer
    risk_map = surefoot.PhysicsPrior(surefoot.Vehicle("pietra_full_size")).judge(surface)
    copy = pickle.loads(pickle.dumps(risk_map))
    assert (copy.shape, copy.resolution_m, copy.origin) == (risk_map.shape, risk_map.resolution_m, risk_map.origin)
    for layer in ["risks", "gradient", "terrain_class", "flags"]:
        assert np.array_equal(getattr(copy, layer), getattr(risk_map, layer)), layer


@pytest.mark.parametrize(
    "layers, message",
    [
        ({"knowledge": np.zeros((4, 4), np.uint8)}, r"knowledge\[0, 0\]: expected 1 or 2 where one is, found 0"),
        ({"knowledge": np.full((4, 4), 3, np.uint8)}, r"knowledge\[0, 0\]: expected 1 or 2"),
        ({"class_probability": np.full((4, 4, 4), 0.3, np.float32)}, r"class_probability\[0, 0\]: expected prob"),
        ({"class_probability": np.full((4, 4, 4), np.nan, np.float32)}, r"class_probability\[0, 0\]: expected prob"),
        ({"class_probability": np.full((4, 4, 3), 0.25, np.float32)}, r"shape \(4, 4, 4\)"),
        (
            {"class_probability": np.full((4, 4, 4), 0.25, np.float32), "terrain_class": np.zeros((4, 4), np.uint8)},
            "no terrain_class beside it",
        ),
    ],
)
def test_layers_that_no_ground_has_are_refused(layers, message):
    with pytest.raises(ValueError, match=message):
        surefoot.Surface.from_arrays(np.zeros((4, 4), np.float32), 0.2, **layers)
