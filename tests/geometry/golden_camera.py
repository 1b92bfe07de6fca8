"""Writes the pixels that test_camera.cpp compares with, by OpenCV: python golden_camera.py

Needs opencv-python-headless. Each row: model (0 none, 1 radtan, 2 equidistant),
fx fy cx cy, four distortion coefficients, x y z, u v.
"""

from pathlib import Path

import cv2
import numpy as np

CAMERAS = [
    (0, (458.654, 457.296, 367.215, 248.375), (0, 0, 0, 0), 1.0),
    (1, (458.654, 457.296, 367.215, 248.375), (-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05), 0.75),
    (1, (600.0, 590.0, 319.5, 239.5), (0.35, -0.05, -0.004, 0.006), 0.9),
    (2, (190.978, 190.973, 254.931, 256.897), (0.0034823894, 0.0007150348, -0.0020532361, 2.0293673e-4), 2.0),
    (2, (300.0, 310.0, 320.0, 240.0), (-0.02, 0.004, 0.001, -0.0005), 1.5),
]


def main() -> None:
    rng = np.random.default_rng(5)
    rows = []
    for model, (fx, fy, cx, cy), k, reach in CAMERAS:
        directions = rng.uniform(-reach, reach, size=(8, 2))
        directions[0] = 0, 0
        directions[1] = 1e-9, -2e-9
        z = rng.uniform(0.3, 20, size=(8, 1))
        points = np.hstack([directions * z, z])
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
        zero = np.zeros(3)
        k = np.array(k, float)
        if model == 2:
            pixels = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), zero, zero, matrix, k)[0]
        else:
            pixels = cv2.projectPoints(points, zero, zero, matrix, k)[0]
        for point, pixel in zip(points, pixels.reshape(-1, 2), strict=True):
            row = [model, fx, fy, cx, cy, *k, *point, *pixel]
            rows.append("{" + ", ".join(repr(float(v)) for v in row) + "},\n")
    Path(__file__).with_name("golden_camera.inc").write_text("".join(rows))


main()
