"""One candidate of a diagnosis fitted in plain Python: SciPy's least_squares for a stand with cubic stiffness.

usage: diagnose.py TRAIN.csv HOLDOUT.csv

The stand is x'' + 2 zeta w x' + w^2 (x + c x^3) = w^2 u with u linear between samples, integrated by a fixed-step
fourth-order Runge-Kutta method in plain Python with NumPy, not compiled.
"""

import json
import sys
import time

import numpy as np
from scipy.optimize import least_squares


def read(path):
    table = np.loadtxt(path, delimiter=",", skiprows=1, usecols=(0, 1, 2))
    return table[1, 0] - table[0, 0], table[:, 1], table[:, 2]


def simulate(values, step, applied):
    frequency, damping, cubic = values
    omega = 2 * np.pi * frequency
    square, loss = omega * omega, 2 * damping * omega

    def slope(x, v, u):
        return v, square * (u - x - cubic * x * x * x) - loss * v

    x = v = 0.0
    motion = np.empty(len(applied))
    u = applied.tolist()
    for i in range(len(u)):
        motion[i] = x
        a, c = u[i], u[min(i + 1, len(u) - 1)]
        b = 0.5 * (a + c)
        x1, v1 = slope(x, v, a)
        x2, v2 = slope(x + 0.5 * step * x1, v + 0.5 * step * v1, b)
        x3, v3 = slope(x + 0.5 * step * x2, v + 0.5 * step * v2, b)
        x4, v4 = slope(x + step * x3, v + step * v3, c)
        x += step / 6 * (x1 + 2 * x2 + 2 * x3 + x4)
        v += step / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
    return motion


def main():
    (step, applied, measured), (_, applied_held, measured_held) = map(read, sys.argv[1:3])
    skip = len(applied) // 25

    def residual(values, u=applied, y=measured):
        left = (y - simulate(values, step, u))[skip:]
        return left - left.mean()

    start = time.perf_counter()
    scale = 1.0 / np.var(measured)
    fit = least_squares(residual, [592.0, 0.07, 0.0], x_scale=[592.0, 0.07, 0.01 * scale])
    seconds = time.perf_counter() - start
    held = residual(fit.x, applied_held, measured_held)
    print(
        json.dumps(
            {
                "seconds": round(seconds, 2),
                "evaluations": int(fit.nfev),
                "values": fit.x.tolist(),
                "train_rms": float(np.sqrt(np.mean(fit.fun**2))),
                "holdout_rms": float(np.sqrt(np.mean(held**2))),
            }
        )
    )


main()
