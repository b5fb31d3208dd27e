"""Periodic rough surfaces with friction, from 2^12 to 2^17 elements: steps of Newton's method, seconds, real contact.

    python benchmarks/rough_surface.py [--most 14]

The solves of the finest mesh and of all coarser ones that `bemkit.run` solves on the way are timed together; seconds of
the processor do not count what other programs do at the same time.
"""

from __future__ import annotations

import argparse
import time

import bemkit as bk


def rough_surface(n_elements: int, mean_pressure: float = 0.02) -> bk.Scene:
    """Return a self-affine surface, 512 of its shortest waves in a period, pressed on and sheared by 9 per cent."""
    obstacle = bk.SelfAffineProfile(period=1.0, rms_height=1e-3, hurst=0.8, roll_off=0.125, cut_off=1 / 512, seed=1)
    return bk.Scene(
        title="rough surface",
        shape=bk.PeriodicHalfPlane(1.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(bk.Part("zone", bk.Contact(obstacle)),),
        far=bk.FarField(force_y=mean_pressure, force_x=0.09 * mean_pressure),
        mesh=bk.MeshOptions(elements=n_elements),
    )


def main() -> None:
    """Print a line for each number of elements."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--least", type=int, default=12)
    parser.add_argument("--most", type=int, default=17)
    arguments = parser.parse_args()
    print("elements  solves cold  solves nested  cascade [s]  processor [s]  contact  certificate")
    for power in range(arguments.least, arguments.most + 1):
        scene = rough_surface(2**power)
        cold = "-"
        if power <= 14:
            from bemkit.runs.steps import run_on_mesh

            cold = str(run_on_mesh(scene).linear_solves)
        begin, busy = time.perf_counter(), time.process_time()
        solution = bk.run(scene, coarsest=1024)
        wall, processor = time.perf_counter() - begin, time.process_time() - busy
        worst = "not converged" if not solution.is_converged else f"{solution.certificate.worst:.1e}"
        print(
            f"{2**power:8d}  {cold:>11s}  {solution.linear_solves:13d}  {wall:11.1f}  {processor:13.1f}  "
            f"{solution.contacts[0].contact_length:7.4f}  {worst}",
            flush=True,
        )


if __name__ == "__main__":
    main()
