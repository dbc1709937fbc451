"""The simulator's predictions beside real ranks, by themselves.

`python -m benchmarks.ranks.predicting [RANKS ...]` learns what work and messages
cost here, predicts three frames for each number of ranks (1, 2 and 4), draws them and
prints both. Ranks run at real-time priority where that is allowed.
"""

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from benchmarks.ranks.calibration import ROUNDS, real_time
from benchmarks.ranks.mpi_frames import RankJob
from benchmarks.ranks.orbits import folded_scene, orbit
from benchmarks.ranks.prediction import Predictor
from renderers.snapshots.client import SnapshotClient

SIDE = 96
SIZE = 256


def main(words: Sequence[str]) -> int:
    """Print a table; the rows come as they are measured."""
    numbers = [int(word) for word in words] or [1, 2, 4]
    launcher = real_time()
    with tempfile.TemporaryDirectory(prefix="paravol-ranks-") as name:
        folder = Path(name)
        client, scene = SnapshotClient(folder), folded_scene(SIDE)
        requests = tuple(
            client.request_classic(scene, camera) for camera in orbit(SIDE, SIZE, 60)
        )
        job = RankJob(requests=requests[:3], rounds=ROUNDS, from_file=True)
        learned = Predictor(job, folder).learn(*launcher)
        host = learned.host
        print(
            f"message {1e6 * host.message_s:.1f} us, bundle {1e6 * host.bundle_s:.1f}, "
            f"byte {1e9 * host.byte_s:.1f} ns, switch {1e6 * host.switch_s:.1f} us, "
            f"both busy {host.busy:.3f}",
            flush=True,
        )
        print("| ranks | predicted ms | measured ms | off |\n| --- | --- | --- | --- |")
        for ranks in numbers:
            drawn = RankJob(
                requests=requests[:3],
                rounds=ROUNDS,
                recorded=True,
                from_file=ranks == 1,
            )
            figures, walls, _ = Predictor(drawn, folder).compare(
                ranks, learned, *launcher
            )
            print(
                f"| {ranks} | {1e3 * figures['predicted_s']:.1f} | "
                f"{1e3 * min(walls):.1f} | {figures['time_off']:+.0%} |",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
