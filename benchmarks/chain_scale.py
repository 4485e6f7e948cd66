"""Growth of time and memory with the number of loops: ladders of four-bars, and robots with the legs of Cassie.

::

    python benchmarks/chain_scale.py            # ladders of 10 to 100 loops, 1 to 8 robots
    python benchmarks/chain_scale.py ladder 50  # one size

Each size runs in a process of its own, so that its peak memory is its own; "before" is that of the process before the
chain is made. A ladder has 3 coordinates and a closure a loop, a robot 30 coordinates and 4 closures. The Jacobian of
their loops falls into blocks, which are solved one by one. The tree itself
is Pinocchio's: one ``pinocchio.Data``, of which a thread has one, makes four arrays of nv³ numbers, 32 nv³ bytes; the
last column is that share. Linux takes it back: "kept" is what the process has at the end, before Pinocchio's own Data
is made for comparison. Times are medians of 7 in CPU time of the calling thread.
"""

import os
import resource
import subprocess
import sys
import time

os.environ.setdefault("EXO_PIN_COMPILE", "compiled")

SIZES = {"ladder": (10, 20, 50, 100), "cassies": (1, 2, 4, 8)}
TURNS = 7


def peak():
    """Largest resident memory of this process so far, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def kept():
    """Resident memory of this process now, MB; the largest so far where the system does not say."""
    if not sys.platform.startswith("linux"):
        return peak()
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20


def median(solve):
    """Median time of a call, ms."""
    times = []
    solve()
    for _ in range(TURNS):
        begun = time.thread_time()
        solve()
        times.append(1e3 * (time.thread_time() - begun))
    return sorted(times)[TURNS // 2]


def measure(kind, size):
    """Measure one size and print its row."""
    import pinocchio as pin
    from large_chains import cassies, ladder, state_of
    from pinocchio_constraints import constrained_dynamics

    warm = cassies(1)
    q, v, tau = state_of(warm)
    warm.forward_dynamics(q, v, tau).forces.joint_reaction("pelvis_0")
    before = peak()
    chain = {"ladder": ladder, "cassies": cassies}[kind](size)
    q, v, tau = state_of(chain)
    model = chain.model
    off = pin.integrate(model, q, 0.01 * tau)

    def forces():
        chain.forward_dynamics(q, v, tau).forces.joint_reaction(model.names[1])

    solvers = [lambda: chain.close(off), lambda: chain.forward_dynamics(q, v, tau), forces]
    close, forward, both = map(median, solvers)
    own, left = peak(), kept()
    # Afterwards, because it has a Data of its own.
    solve, _ = constrained_dynamics(chain)
    cells = [close, median(lambda: solve(q, v, tau)), forward, both]
    times = "".join(f"{cell:>11.3f}" for cell in cells)
    share = 32 * model.nv**3 / 2**20
    print(
        f"{kind:8}{size:>5}{model.nv:>6}{chain.row_count:>6}{times}{before:>10.0f}{own:>8.0f}{left:>8.0f}{share:>8.0f}"
    )


def main():
    """Measure the size that the command line names, or all."""
    if len(sys.argv) == 3:
        measure(sys.argv[1], int(sys.argv[2]))
        return
    print(
        f"{'chain':8}{'size':>5}{'nv':>6}{'rows':>6}{'close':>11}{'Pinocchio':>11}{'forward':>11}{'and forces':>11}"
        f"{'before':>10}{'peak':>8}{'kept':>8}{'Data':>8}"
    )
    print(f"{'':25}{'ms':>11}{'ms':>11}{'ms':>11}{'ms':>11}{'MB':>10}{'MB':>8}{'MB':>8}{'MB':>8}", flush=True)
    for kind, sizes in SIZES.items():
        for size in sizes:
            subprocess.run([sys.executable, __file__, kind, str(size)], check=True)


if __name__ == "__main__":
    main()
