"""A block on a rough floor with friction: real area of contact against pressure, on compressed equations.

    python tests/benchmarks/rough_block.py [--contact N] [--picture FILE.png]

A block of width 1 is pressed on a self-affine profile (Hurst exponent 0.8, friction coefficient 0.3) in steps; nine
tenths of the elements are in contact (default 20 000). It prints for each pressure the share of the lower side that
touches, that of it which sticks, contact steps and the largest violation.
"""

from __future__ import annotations

import argparse
import time

import matplotlib.pyplot as plt
import numpy as np

import bemkit as bk
from bemkit.operators.hierarchy import compiled
from bemkit.solvers.active_sets import NodeStatus

PRESSURES = (0.002, 0.005, 0.01, 0.02, 0.04)


def rough_block(n_contact: int) -> bk.Scene:
    """Return the block under the largest pressure, with steps up to it."""
    obstacle = bk.SelfAffineProfile(period=1.0, rms_height=1e-3, hurst=0.8, roll_off=0.25, cut_off=1 / 1024, seed=1)
    return bk.Scene(
        title="rough block",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(
            bk.Part("floor", bk.Contact(obstacle), sides=("bottom",)),
            bk.Part("press", bk.Pressure(PRESSURES[-1]), sides=("top",)),
        ),
        discretisation=bk.ConstantCollocation(),
        linear_solver=bk.Hierarchical(),
        load_factors=tuple(pressure / PRESSURES[-1] for pressure in PRESSURES),
        mesh=bk.MeshOptions(elements=n_contact * 10 // 9, density={"bottom": 27.0}),
    )


def picture(steps: list[bk.Solution], areas: list[float]) -> plt.Figure:
    """Draw the real area against pressure, and pressures on a hundredth of the block."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 3.6), layout="constrained")
    left.loglog(PRESSURES, areas, "o-")
    for axis, values in ((left.xaxis, PRESSURES), (left.yaxis, np.round(areas, 2))):
        axis.set_ticks(values, [f"{value:g}" for value in values])
        axis.set_ticks([], minor=True)
    left.set(xlabel="pressure on the block [E]", ylabel="share of the lower side that touches")
    for step, pressure in ((steps[k], PRESSURES[k]) for k in (0, 2, 4)):
        x, order = step.contact.x, np.argsort(step.contact.x)
        order = order[(x[order] > 0.48) & (x[order] < 0.52)]
        right.plot(x[order], -step.contact.sigma_n[order], label=f"{pressure:g}")
    right.set(xlabel="x", ylabel="contact pressure [E]")
    right.legend(title="pressure on the block")
    return figure


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--contact", type=int, default=20000)
    parser.add_argument("--picture")
    options = parser.parse_args()
    compiled.functions()  # compiles now, not within a measurement
    clock = time.process_time()
    steps = bk.run_history([rough_block(options.contact)])
    seconds = time.process_time() - clock
    print(f"{steps[0].contact.n_contact} contact elements of {steps[0].mesh.n_elements}, {seconds:.0f} CPU seconds")
    print("pressure  touching  of it sticking  steps  largest violation")
    areas = []
    for step, pressure in zip(steps, PRESSURES, strict=True):
        contact = step.contact
        touches, sticks = contact.status != NodeStatus.SEPARATED, contact.status == NodeStatus.STICK
        areas.append(float(contact.weight[touches].sum()))
        share = float(contact.weight[sticks].sum()) / areas[-1]
        print(
            f"{pressure:8g}  {areas[-1]:8.4f}  {share:14.3f}  {step.outer_steps:5d}  {step.certificate.worst:17.0e}",
            flush=True,
        )
    if options.picture:
        picture(list(steps), areas).savefig(options.picture, dpi=110)


if __name__ == "__main__":
    main()
