"""A block on a rough floor with friction: real area of contact against pressure, on compressed equations.

    python benchmarks/rough_block.py [--contact N] [--picture FILE.png]

A block of width 1 is pressed on a self-affine profile (Hurst exponent 0.8, friction coefficient 0.3) in steps; nine
tenths of the elements are in contact (default 20 000). It prints for each pressure the share of the lower side that
touches, what Persson's theory says of a half-plane without friction [Persson2001], the share of it that sticks,
contact steps and the largest violation.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence

import matplotlib.pyplot as plt
import numpy as np
from scipy.special import erf

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.operators.collocation import compiled
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


def persson_share(pressures: FloatArray, scene: bk.Scene) -> FloatArray:
    """Return the share that touches by [Persson2001], in plane strain and without friction.

    Waves of amplitude h and wave number q take pressures E' q h / 2 to be pressed flat, so that those of the whole
    profile have the variance (E' slope / 2)^2; that of the pressures at contact is the same less what tension
    would take: erf(sqrt(2) p / (E' slope)).
    """
    condition = scene.parts[0].condition
    assert isinstance(condition, bk.Contact)
    assert isinstance(condition.obstacle, bk.SelfAffineProfile)
    stiffness = scene.material.plane_modulus * condition.obstacle.rms_slope
    return np.asarray(erf(np.sqrt(2.0) * pressures / stiffness))


def picture(scene: bk.Scene, steps: Sequence[bk.Solution], areas: list[float]) -> plt.Figure:
    """Draw the real area against pressure, and pressures on a part of the block and on a part of that."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13.0, 3.8), layout="constrained")
    pressures = np.geomspace(0.7 * PRESSURES[0], 1.4 * PRESSURES[-1])
    theory = persson_share(pressures, scene)
    left.loglog(pressures, theory, "-", color="0.6", label="Persson's theory")
    left.loglog(pressures, theory[0] / pressures[0] * pressures, "--", color="0.8", label="in proportion to pressure")
    left.loglog(PRESSURES, areas, "o", label="block with friction 0.3")
    left.set_ylim(0.7 * areas[0], 1.2)
    for axis, values in ((left.xaxis, PRESSURES), (left.yaxis, np.round(areas, 2))):
        axis.set_ticks(values, [f"{value:g}" for value in values])
        axis.set_ticks([], minor=True)
    left.set(xlabel="pressure on the block [E]", ylabel="share of the lower side that touches")
    left.legend(fontsize="small")
    for axes, (begin, end) in ((middle, (0.45, 0.55)), (right, (0.498, 0.502))):
        for k in (4, 2, 0):
            x, order = steps[k].contact.x, np.argsort(steps[k].contact.x)
            order = order[(x[order] > begin) & (x[order] < end)]
            axes.fill_between(x[order], -steps[k].contact.sigma_n[order], label=f"{PRESSURES[k]:g}", lw=0.0)
        axes.set(xlabel="x", ylabel="contact pressure [E]", xlim=(begin, end), ylim=(0.0, None))
    right.legend(title="pressure", fontsize="small")
    return figure


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--contact", type=int, default=20000)
    parser.add_argument("--picture")
    options = parser.parse_args()
    compiled.loaded()  # compiles now, not within a measurement
    clock = time.process_time()
    scene = rough_block(options.contact)
    steps = bk.run([scene])
    seconds = time.process_time() - clock
    print(f"{steps[0].contact.n_contact} contact elements of {steps[0].mesh.n_elements}, {seconds:.0f} CPU seconds")
    print("pressure  touching  Persson  of it sticking  steps  largest violation")
    areas = []
    theory = persson_share(np.array(PRESSURES), scene)
    for step, pressure, expected in zip(steps, PRESSURES, theory, strict=True):
        contact = step.contact
        touches, sticks = contact.status != NodeStatus.SEPARATED, contact.status == NodeStatus.STICK
        areas.append(float(contact.weight[touches].sum()))
        share = float(contact.weight[sticks].sum()) / areas[-1]
        print(
            f"{pressure:8g}  {areas[-1]:8.4f}  {expected:7.4f}  {share:14.3f}  {step.outer_steps:5d}  "
            f"{step.certificate.worst:17.0e}",
            flush=True,
        )
    if options.picture:
        picture(scene, steps, areas).savefig(options.picture, dpi=80)


if __name__ == "__main__":
    main()
