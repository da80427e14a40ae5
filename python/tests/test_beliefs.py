"""What is fused, and how it is judged."""

import ground
import numpy as np
import pytest
import surefoot

LEVEL, RAMP = 0.0, np.tan(np.radians(10.0))


@pytest.fixture(scope="module")
def vehicle():
    return surefoot.Vehicle("pietra_full_size")


def ramp(rise, **layers):
    """32 x 24 m in cells of 0.2 m: level in the west, from x = 16 m on it rises eastwards."""
    x_m, _ = ground.centres_m(120, 160, 0.2, (0, 0))
    return surefoot.Surface.from_arrays((np.maximum(x_m - 16.0, 0.0) * rise).astype(np.float32), 0.2, **layers)


def test_physics_takes_traction_by_the_slope_and_tells_its_pitch(vehicle):
    settings = {"prior": {"slope_law": {"linear": {}}, "lean": [1.0, 1.0]}}
    share = surefoot.settings_for(vehicle)["prior"]["uniform_weight"]
    risk_map = surefoot.PhysicsPrior(vehicle, settings, cvar_level=1.0).judge(ramp(RAMP))
    assert risk_map.shape[:2] == (120, 160)
    # PIETRA, equations 15 and 18: 1 - tan(slope) / tan(30 degrees), a share of it spread over all.
    for x_m, rise in [(8.0, LEVEL), (26.0, RAMP)]:
        linear, _, roll_rad, pitch_rad = risk_map.risk_at((x_m, 12.0, 0.05))
        assert linear == pytest.approx((1 - share) * (1 - rise / np.tan(np.radians(30.0))) + share / 2, abs=0.01)
        assert pitch_rad >= np.arctan(rise) - 0.01 and pitch_rad < np.arctan(rise) + 0.06
        assert roll_rad < 0.06
    # Along the slope it leans to the side instead.
    _, _, roll_rad, pitch_rad = risk_map.risk_at((26.0, 12.0, np.pi / 2 + 0.05))
    assert roll_rad > 0.15 and pitch_rad < 0.08


def test_a_smaller_share_of_the_worst_is_worse(vehicle):
    surface = ramp(RAMP)
    mean, worst = (surefoot.PhysicsPrior(vehicle, cvar_level=level).judge(surface).risks for level in (1.0, 0.1))
    inside = (slice(20, -20), slice(20, -20))
    assert (worst[inside][..., :2] <= mean[inside][..., :2]).all()
    assert (worst[inside][..., 2:] >= mean[inside][..., 2:]).all()
    assert (worst[inside] != mean[inside]).any()


def test_an_obstacle_blocks_whoever_touches_it(vehicle):
    terrain_class = np.zeros((120, 160), np.uint8)
    terrain_class[60, 40] = 3
    risk_map = surefoot.PhysicsPrior(vehicle).judge(ramp(LEVEL, terrain_class=terrain_class))
    x_m, y_m = 40.5 * 0.2, 60.5 * 0.2
    assert risk_map.risk_at((x_m, y_m, 0.0))[2] >= surefoot.RiskMap.BLOCKED_RAD
    # 3.4 m long, its rear axle's centre 6 m away.
    assert risk_map.risk_at((x_m + 6.0, y_m, 0.0))[2] < 1.0
    assert risk_map.flags[60, 40] & 1 and risk_map.terrain_class[60, 40] == 3


def test_a_hole_is_unknown_ground(vehicle):
    height_m = np.zeros((120, 160), np.float32)
    height_m[40:80, 60:100] = np.nan
    risk_map = surefoot.PhysicsPrior(vehicle).judge(surefoot.Surface.from_arrays(height_m, 0.2))
    assert risk_map.flags[60, 80] & 2 and not risk_map.flags[60, 20] & 2
    assert risk_map.risk_at((16.1, 12.1, 0.1))[0] < 0.5 < risk_map.risk_at((4.1, 12.1, 0.1))[0]


def test_a_window_lies_where_it_is_asked_for_and_says_the_same(vehicle):
    prior, surface = surefoot.PhysicsPrior(vehicle, {"risk_map": {"n_rows": 31, "n_cols": 41}}), ramp(RAMP)
    whole, part = prior.judge(surface), prior.judge(surface, centre_m=(20.1, 10.1))
    assert part.shape == (31, 41, 16)
    # The middle of cell (100, 50) is that of 41 columns from 80 on and of 31 rows from 35 on.
    west, south = 80, 35
    assert part.origin == (west, south)
    np.testing.assert_array_equal(
        part.risks[1:-1, 1:-1], whole.risks[south + 1 : south + 30, west + 1 : west + 40]
    )
    moved = prior.judge(surface, centre_m=(20.3, 10.1))
    assert moved.origin == (west + 1, south)
    np.testing.assert_array_equal(moved.risks[1:-1, 1:-2], part.risks[1:-1, 2:-1])


def test_networks_count_where_ground_is_like_their_training(vehicle):
    x_m, y_m = ground.centres_m(100, 200, 0.2, (0, 0))
    rolling_m = 0.05 * np.sin(x_m / 3.0) * np.cos(y_m / 3.0)
    height_m = np.where(x_m < 20.0, rolling_m, np.floor(x_m / 2.0) % 2).astype(np.float32)
    surface = surefoot.Surface.from_arrays(height_m, 0.2)
    learned = surefoot.Evidential.load(vehicle)
    assert learned.method == "pietra"
    judged, physics = learned.judge(surface), surefoot.PhysicsPrior(vehicle).judge(surface)
    familiar, steps = (slice(30, 70), slice(20, 80)), (slice(30, 70), slice(120, 180))
    strange = judged.flags & 4 != 0
    assert strange[steps].mean() > 0.5 and strange[familiar].mean() < 0.1
    assert np.abs(judged.risks[familiar] - physics.risks[familiar])[..., 0].mean() > 0.01


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ((surefoot.Vehicle("sedan"),), "networks of method pietra: trained on vehicle"),
        ((surefoot.Vehicle("pietra_full_size"), "magic"), "method: expected one of pietra, "),
        ((surefoot.Vehicle("pietra_full_size"), "evora-physics-prior"), "expected some that come with the program"),
    ],
)
def test_networks_that_are_not_there_are_told(arguments, told):
    with pytest.raises(ValueError) as refusal:
        surefoot.Evidential.load(*arguments)
    assert told in str(refusal.value)


def test_networks_of_broken_bytes_are_refused(vehicle):
    for weights, sidecar in [(b"", b""), (b"\xff" * 64, b"{}"), (b"\x00" * 8, b"not json")]:
        with pytest.raises(ValueError):
            surefoot.Evidential.from_bytes(vehicle, weights, sidecar)


@pytest.mark.parametrize("level", [0.0, -0.5, 1.5, float("nan"), float("inf")])
def test_levels_that_are_none_are_refused(vehicle, level):
    for make in (surefoot.PhysicsPrior, surefoot.Evidential.load):
        with pytest.raises(ValueError, match=r"alpha \(CVaR level\): expected a number in \(0, 1\], found"):
            make(vehicle, cvar_level=level)


def test_windows_beyond_reason_are_refused(vehicle):
    prior = surefoot.PhysicsPrior(vehicle)
    for centre_m in [(np.nan, 0.0), (1e300, 0.0)]:
        with pytest.raises(ValueError, match="centre_m: expected a position within"):
            prior.judge(ramp(LEVEL), centre_m=centre_m)
    with pytest.raises(ValueError, match=r"risk_map\.n_rows: expected a whole number from 3 to 4096, found 1"):
        surefoot.PhysicsPrior(vehicle, {"risk_map": {"elevation_cells": 100}}).judge(ramp(LEVEL))
    with pytest.raises(TypeError) as refusal:
        prior.judge(np.zeros((9, 9), np.float32))
    assert str(refusal.value) == "ground: expected a Surface or an ElevationMap, found ndarray"


def scan(rng, n_points=20_000):
    """Points of level ground 0.5 m below the body frame, as a sensor on the vehicle sees them."""
    x_m, y_m = rng.uniform(-10.0, 10.0, (2, n_points))
    return np.stack([x_m, y_m, rng.normal(-0.5, 0.01, n_points)], axis=1).astype(np.float32)


def test_points_become_heights_in_the_map_frame():
    points, elevation = scan(np.random.default_rng(4)), surefoot.ElevationMap()
    points[:7] = np.nan
    report = elevation.fuse(points, (30.0, -20.0, 2.0, 0.0, 0.0, np.pi / 2), origin_m=(0.0, 0.0, 1.0))
    assert (report.n_points, report.n_rejected_non_finite) == (20_000, 7)
    assert report.n_mapped == 20_000 - 7 - report.n_own_body - report.n_out_of_window
    surface = elevation.surface()
    x_m, y_m = ground.centres_m(*surface.shape, surface.resolution_m, surface.origin)
    seen = (np.abs(x_m - 30.0) < 8.0) & (np.abs(y_m + 20.0) < 8.0)
    assert np.abs(surface.height_m[seen] - 1.5).max() < 0.05
    beyond = (np.abs(x_m - 30.0) > 12.0) | (np.abs(y_m + 20.0) > 12.0)
    assert np.isnan(surface.height_m[beyond]).all()


def test_a_measured_map_is_judged_as_the_surface_that_it_shows(vehicle):
    settings = surefoot.settings_for(vehicle, {"elevation": {"n_rows": 80, "n_cols": 80, "resolution_m": 0.25}})
    elevation = surefoot.ElevationMap(settings["elevation"])
    elevation.fuse(scan(np.random.default_rng(5)), np.zeros(6), origin_m=(0.0, 0.0, 1.0))
    prior = surefoot.PhysicsPrior(vehicle, settings)
    np.testing.assert_array_equal(prior.judge(elevation).risks, prior.judge(elevation.surface()).risks)


def test_a_surface_stays_as_it_was_when_scans_come():
    elevation = surefoot.ElevationMap()
    before = elevation.surface()
    elevation.fuse(scan(np.random.default_rng(6)), np.zeros(6), origin_m=(0.0, 0.0, 1.0))
    assert np.isnan(before.height_m).all() and not np.isnan(elevation.surface().height_m).all()


@pytest.mark.parametrize(
    ("changes", "error", "told"),
    [
        ({"points": np.zeros((4, 2), np.float32)}, ValueError, "points: expected shape (4, 3), found shape (4, 2)"),
        ({"points": np.zeros((4, 3))}, TypeError, "points: expected an array of float32 with axes (point, 3)"),
        ({"pose": np.zeros(5)}, ValueError, "pose: expected 6 numbers (x_m, y_m, z_m, roll_rad, pitch_rad, yaw_rad)"),
        ({"pose": "abcdef"}, TypeError, "pose: expected 6 numbers"),
        ({"pose": (np.nan, 0, 0, 0, 0, 0)}, ValueError, "expected a pose of finite numbers"),
        ({"pose": (1e300, 0, 0, 0, 0, 0)}, ValueError, "expected a position within"),
        ({"origin_m": (np.inf, 0, 0)}, ValueError, "expected a ray origin of finite numbers"),
        ({"terrain_class": np.zeros(3, np.uint8)}, ValueError, "terrain_class: expected shape (4,), found shape (3,)"),
        ({"terrain_class": np.full(4, 9, np.uint8)}, ValueError, "terrain_class[0]: expected a class from 0 to 3, found 9"),
    ],
)
def test_scans_that_cannot_be_are_refused_and_leave_the_map_as_it_was(changes, error, told):
    elevation = surefoot.ElevationMap()
    arguments = {"points": np.zeros((4, 3), np.float32), "pose": np.zeros(6)} | changes
    with pytest.raises(error) as refusal:
        elevation.fuse(**arguments)
    assert told in str(refusal.value)
    assert np.isnan(elevation.surface().height_m).all()
