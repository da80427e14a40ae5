"""Hilly ground with three terrain classes, made from smoothed noise."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

OPEN, LOOSE, VEGETATION = 0, 1, 2
LOOSE_SHARE, VEGETATION_SHARE = 0.22, 0.28


@dataclass(frozen=True)
class GroundShape:
    """What a map looks like: nodes a side, metres between nodes, hill height (standard deviation) and width."""

    nodes: int
    resolution_m: float
    height_std_m: float
    hill_width_m: float


class Ground:
    """Heights and classes on a square grid centred on the origin; row = x, column = y."""

    def __init__(self, shape: GroundShape, seed: int):
        generator = np.random.default_rng([seed, 11])
        self.shape = shape
        self.half_extent_m = 0.5 * (shape.nodes - 1) * shape.resolution_m
        self.height_m = np.round(_hills(shape, generator), 3)
        self.terrain_class = _classes(shape, generator)

    def _cell(self, position_m: float) -> tuple[int, float]:
        """Lower node and fraction towards the next; positions off the map are held at its edge."""
        along = (position_m + self.half_extent_m) / self.shape.resolution_m
        along = min(max(along, 0.0), self.shape.nodes - 1.001)
        return int(along), along - int(along)

    def surface(self, x_m: float, y_m: float) -> tuple[float, float, float]:
        """Height and its slopes along x and y, bilinear."""
        (i, u), (j, v) = self._cell(x_m), self._cell(y_m)
        low, right = self.height_m[i, j], self.height_m[i + 1, j]
        left, high = self.height_m[i, j + 1], self.height_m[i + 1, j + 1]
        height = (low * (1 - u) + right * u) * (1 - v) + (left * (1 - u) + high * u) * v
        slope_x = ((right - low) * (1 - v) + (high - left) * v) / self.shape.resolution_m
        slope_y = ((left - low) * (1 - u) + (high - right) * u) / self.shape.resolution_m
        return height, slope_x, slope_y

    def body_slopes(self, x_m: float, y_m: float, yaw_rad: float) -> tuple[float, float, float]:
        """Height, and rise per metre forwards and to the left."""
        height, slope_x, slope_y = self.surface(x_m, y_m)
        cos, sin = np.cos(yaw_rad), np.sin(yaw_rad)
        return height, slope_x * cos + slope_y * sin, slope_y * cos - slope_x * sin

    def class_at(self, x_m: float, y_m: float) -> int:
        """Class of the nearest node."""
        (i, u), (j, v) = self._cell(x_m), self._cell(y_m)
        return int(self.terrain_class[i + (u >= 0.5), j + (v >= 0.5)])


def _smooth(shape: GroundShape, generator: np.random.Generator, width_nodes: float) -> np.ndarray:
    """Smoothed white noise with mean 0 and standard deviation 1."""
    margin = int(4 * width_nodes)
    noise = generator.standard_normal((shape.nodes + 2 * margin,) * 2)
    field = gaussian_filter(noise, width_nodes)[margin:-margin, margin:-margin]
    return (field - field.mean()) / field.std()


def _hills(shape: GroundShape, generator: np.random.Generator) -> np.ndarray:
    width_nodes = shape.hill_width_m / shape.resolution_m
    field = _smooth(shape, generator, width_nodes) + 0.2 * _smooth(shape, generator, 0.5 * width_nodes)
    return shape.height_std_m * (field - field.mean()) / field.std()


def _classes(shape: GroundShape, generator: np.random.Generator) -> np.ndarray:
    field = _smooth(shape, generator, shape.nodes / 24.0)
    low, high = np.quantile(field, [LOOSE_SHARE, 1.0 - VEGETATION_SHARE])
    return np.where(field < low, LOOSE, np.where(field > high, VEGETATION, OPEN)).astype(int)
