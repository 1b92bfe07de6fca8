"""The processes of tools/demo: a recording through the live pipeline, then the replay of what was logged.

    demo_pipeline.py --programs build/demo/tools --out FOLDER --estimator "--preset robust" lcm-log FILE

First pass: loc-live starts hub, logger, estimator and driver, everything goes over LCM into FOLDER/live.log.
Second pass: lcm-logplayer sends the sensor messages of live.log to a new loc-estimator; FOLDER/replay.log.
With --pictures it is loc-driver that sends them: it waits for an estimator whose queue holds few pictures.
The output of every process is in FOLDER/*.txt. Ctrl-C stops all of them.
"""

import argparse
import signal
import subprocess
import sys
import time
from pathlib import Path

# What the estimator takes, and the note that the source has ended; the estimates in the log stay out.
REPLAYED_CHANNELS = "^LOC_(IMU|MAGNETOMETER|SOURCE_STATUS)$"
PASS_TIMEOUT_S = 300


class PipelineError(RuntimeError):
    pass


class Processes:
    """Child processes that are stopped in the reverse order of their start."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.running: list[tuple[str, subprocess.Popen]] = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        while self.running:
            self.stop(self.running[-1][0])

    def output_of(self, name: str) -> Path:
        return self.folder / f"{name}.txt"

    def start(self, name: str, *command: str | Path) -> None:
        with self.output_of(name).open("w") as output:
            process = subprocess.Popen(
                [str(part) for part in command],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,  # Ctrl-C reaches this script only, which stops the others in order
            )
        self.running.append((name, process))

    def process(self, name: str) -> subprocess.Popen:
        return next(process for known, process in self.running if known == name)

    def failure(self, name: str, what: str) -> PipelineError:
        tail = self.output_of(name).read_text(errors="replace").splitlines()[-8:]
        return PipelineError("\n  | ".join([f"{name} {what}; {self.output_of(name)} ends with:", *tail]))

    def check(self) -> None:
        """Raises when one has ended with an error."""
        for name, process in self.running:
            if process.poll():
                raise self.failure(name, f"ended with exit code {process.returncode}")

    def stop(self, name: str) -> None:
        process = self.process(name)
        for stop_signal, patience_s in ((signal.SIGINT, 10), (signal.SIGTERM, 5), (signal.SIGKILL, 5)):
            if process.poll() is not None:
                break
            process.send_signal(stop_signal)
            try:
                process.wait(patience_s)
            except subprocess.TimeoutExpired:
                continue
        self.running.remove((name, process))


def wait_until(what: str, ready, processes: Processes, timeout_s: float = 20):
    """Polls ready() until it gives something."""
    deadline = time.monotonic() + timeout_s
    while not (result := ready()):
        processes.check()
        if time.monotonic() > deadline:
            raise PipelineError(f"waited {timeout_s:.0f} s for {what}")
        time.sleep(0.05)
    return result


def size_of(log: Path) -> int:
    return log.stat().st_size if log.exists() else 0


def wait_for_end(label: str, last: str, log: Path, processes: Processes) -> None:
    """Until the process `last` has ended and the log has stopped growing; shows how far it is."""
    started = last_change = time.monotonic()
    last_size = -1
    while processes.process(last).poll() is None or time.monotonic() - last_change < 0.5:
        processes.check()
        now, size = time.monotonic(), size_of(log)
        if size != last_size:
            last_size, last_change = size, now
        if now - started > PASS_TIMEOUT_S:
            raise PipelineError(f"{label}: not done after {PASS_TIMEOUT_S} s")
        if sys.stdout.isatty():
            print(f"\r\033[K{label}: {size / 1e6:.0f} MB logged", end="", flush=True)
        time.sleep(0.1)
    processes.check()
    clear = "\r\033[K" if sys.stdout.isatty() else ""
    print(f"{clear}{label}: {last_size / 1e6:.0f} MB logged in {last_change - started:.0f} s", flush=True)


def run_live(
    programs: Path, source: list[str], estimator: str, log: Path, more: list[str], label: str = "live"
) -> None:
    log.unlink(missing_ok=True)
    with Processes(log.parent) as processes:
        processes.start(
            "loc-live",
            *(programs / "loc-live", *source, "--transport", "hub", "--log", log),
            *("--estimator-args", estimator, *more),
        )
        wait_for_end(label, "loc-live", log, processes)


def run_replay(programs: Path, recorded: Path, estimator: str, log: Path) -> None:
    log.unlink(missing_ok=True)
    with Processes(log.parent) as processes:

        def hub_url() -> str | None:
            words = processes.output_of("loc-hub").read_text().split()
            return next((word for word in words if word.startswith("tcpq://")), None)

        processes.start("loc-hub", programs / "loc-hub", "--port", "0")
        url = wait_until("loc-hub to listen", hub_url, processes)
        processes.start("lcm-logger", "lcm-logger", "--quiet", f"--lcm-url={url}", log)
        processes.start(
            "loc-estimator",
            *(programs / "loc-estimator", "--lcm-url", url, "--exit-at-end", "--statistics"),
            *estimator.split(),
        )
        # Its statistics in the log: logger and estimator have both connected.
        wait_until("the first statistics in the log", lambda: size_of(log), processes)
        processes.start(
            "lcm-logplayer",
            *("lcm-logplayer", f"--lcm-url={url}", f"--regexp={REPLAYED_CHANNELS}", recorded),
        )
        wait_for_end("replay", "loc-estimator", log, processes)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--programs", type=Path, required=True, help="folder that holds loc-live and the others"
    )
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--estimator", default="", help="options of loc-estimator, in one string")
    parser.add_argument("--config", type=Path, help="calibration (rig.yaml), for driver and estimator")
    parser.add_argument("--driver", default="", help="more options of loc-driver, in one string")
    parser.add_argument("--pictures", action="store_true", help="pictures are among the measurements")
    parser.add_argument("source", nargs=2, metavar=("KIND", "PATH"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    live, replay = arguments.out / "live.log", arguments.out / "replay.log"
    more = ["--speed", "max"]
    if arguments.config is not None:
        more += ["--config", str(arguments.config)]
    driver = ["--driver-args", arguments.driver] if arguments.driver else []
    try:
        run_live(arguments.programs, arguments.source, arguments.estimator, live, more + driver)
        if arguments.pictures:
            again = ["lcm-log", str(live)]
            run_live(arguments.programs, again, arguments.estimator, replay, more, "replay")
        else:
            run_replay(arguments.programs, live, arguments.estimator, replay)
    except (PipelineError, OSError) as error:
        print(f"demo_pipeline.py: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("demo_pipeline.py: interrupted", file=sys.stderr)
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
