"""Pictures live: 30 and 200 IMU samples a second through driver, LCM, estimator and logger, for long.

    python tests/bench/live_pictures.py --programs build/test/tools [--minutes 0.5] [--udp] [--view COMMAND]

Input: the simulator's scenario "circle" (at rest, then laps of 10 m radius at 5 m/s) with rendered pictures,
752x480, JPEG. Laps are alike, and 377 pictures make one within 0.3 ms; so the pictures of one lap are played
again and again, with the IMU of three laps, after which both begin anew. Time goes on; only the walk of the
IMU's biases begins anew as well. Noise of the pictures and of the IMU repeats.

Started: loc-hub, or with --udp udpm on a multicast route of an own network (run it all in "unshare -rn");
loc-estimator --method inertial-slam --images, lcm-logger, --view COMMAND with the URL in LCM_DEFAULT_URL, and
the driver at the pace of the stamps.

Printed: pictures and IMU samples sent, used and dropped; latency from the arrival of a picture to its pose in
the log; CPU time and memory (resident, after each sixth of the run) of each program; load.
Of the first 5 s the latency is printed apart: pictures wait until the start is found.
Judged: nothing dropped, p99 <= 33 ms, the estimator's memory grows by less than 5 % after the first sixth.
Exit code 1 when something of that is missed or a program failed.
"""

import argparse
import csv
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import lcm
import numpy as np

RATE_HZ, LAP_PICTURES, LAPS, IMU_HZ = 30, 377, 3, 200
STEADY_S = 10.0  # by then it is on the circle
MAX_P99_MS, START_S = 33, 5
PERIOD_NS = round(LAPS * LAP_PICTURES / RATE_HZ * 1e9)


def run(command, **more):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, **more)
    if done.returncode != 0:
        sys.exit(f"{command[0]} failed ({done.returncode}): {done.stderr[-2000:]}")


def rows_of(path):
    with path.open(newline="") as file:
        rows = list(csv.reader(file))
    return rows[0], rows[1:]


def looped(rows, first_ns, count, period_ns, end_ns):
    """The rows before first_ns, then count rows from there again and again, up to a time."""
    begin = next(i for i, row in enumerate(rows) if int(row[0]) >= first_ns)
    loop = rows[begin : begin + count]
    if len(loop) != count:
        sys.exit(f"the simulation is too short: {len(loop)} of {count} rows")
    yield from rows[:begin]
    turn = 0
    while True:
        for row in loop:
            stamp = int(row[0]) + turn * period_ns
            if stamp > end_ns:
                return
            yield [str(stamp), *row[1:]]
        turn += 1


def make_input(programs, folder, seconds):
    """A EuRoC recording of that length; pictures stand in it once and are listed many times."""
    simulate = [programs / "loc-simulate", "--scenario", "circle", "--seed", "1"]
    simulate += ["--set", f"camera.rate_hz={RATE_HZ}"]
    short, long = STEADY_S + LAP_PICTURES / RATE_HZ + 0.2, STEADY_S + PERIOD_NS * 1e-9 + 0.2
    streams = ("--images", "--streams", "imu,features", "--out", folder / "sim")
    run([*simulate, "--duration", f"{short}s", *streams])
    run([*simulate, "--duration", f"{long}s", "--streams", "imu", "--out", folder / "imu"])
    mav = folder / "sim/mav0"
    heading, pictures = rows_of(mav / "cam0/data.csv")
    imu_heading, imu = rows_of(folder / "imu/mav0/imu0/data.csv")
    start_ns = int(imu[0][0])
    first_ns, end_ns = start_ns + round(STEADY_S * 1e9), start_ns + round(seconds * 1e9)
    lap_ns = round(LAP_PICTURES / RATE_HZ * 1e9)
    imu_rows = round(PERIOD_NS * 1e-9 * IMU_HZ)
    for path, head, rows in (
        (mav / "cam0/data.csv", heading, looped(pictures, first_ns, LAP_PICTURES, lap_ns, end_ns)),
        (mav / "imu0/data.csv", imu_heading, looped(imu, first_ns, imu_rows, PERIOD_NS, end_ns)),
    ):
        with path.open("w", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow(head)
            writer.writerows(rows)
    return folder / "sim"


class Process:
    def __init__(self, name, command, log, **environment):
        self.name, self.log = name, log
        self.process = subprocess.Popen(
            [str(c) for c in command],
            stdout=subprocess.DEVNULL,
            stderr=log.open("w"),
            env=os.environ | environment,
        )
        self.cpu_s, self.memory_kb, self.memory_each_kb = 0.0, 0, []

    def look(self, note):
        try:
            stat = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
            memory = re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{self.process.pid}/status").read_text())
        except OSError:
            return
        if memory is None:  # it has ended
            return
        self.cpu_s = (int(stat[11]) + int(stat[12])) / os.sysconf("SC_CLK_TCK")
        self.memory_kb = int(memory[1])
        if note:
            self.memory_each_kb.append(self.memory_kb)

    def end(self, number=signal.SIGINT, patience=20):
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            return -1

    def last(self, event):
        lines = [line for line in Path(self.log).read_text().splitlines() if f"event={event}" in line]
        return dict(re.findall(r"([\w.]+)=(\S+)", lines[-1])) if lines else {}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--programs", type=Path, required=True, help="folder with loc-driver and the others")
    parser.add_argument("--minutes", type=float, default=0.5)
    parser.add_argument("--udp", action="store_true")
    parser.add_argument(
        "--reorder-delay-ms", default="50", help="of loc-estimator: how long IMU samples wait for pictures"
    )
    parser.add_argument("--view", help="a viewer to run beside it, with its arguments")
    parser.add_argument(
        "--work", type=Path, help="folder for input, log and log lines (default: a temporary one)"
    )
    options = parser.parse_args()
    seconds = max(20.0, 60 * options.minutes)
    folder = Path(options.work or tempfile.mkdtemp(prefix="live-pictures-")).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    recording = make_input(options.programs, folder, seconds)
    print(f"input: {seconds:.0f} s, load of the machine before: {os.getloadavg()[0]:.1f}", flush=True)

    started = []
    try:
        url = "udpm://239.255.76.67:7667?ttl=0&recv_buf_size=4194304"
        if options.udp:
            run(["ip", "link", "set", "lo", "up"])
            run(["ip", "route", "replace", "224.0.0.0/4", "dev", "lo"])
        else:
            hub = Process("loc-hub", [options.programs / "loc-hub", "--port", "0"], folder / "hub.log")
            started.append(hub)
            for _ in range(100):
                time.sleep(0.1)
                if found := re.search(r"address=(\S+) port=(\d+)", Path(hub.log).read_text()):
                    break
            else:
                sys.exit(f"loc-hub does not say where it listens: {Path(hub.log).read_text()}")
            url = f"tcpq://{found[1]}:{found[2]}"
        estimator = Process(
            "loc-estimator",
            [
                *(options.programs / "loc-estimator", "--method", "inertial-slam", "--images"),
                *("--rig", write_rig(options.programs, folder), "--lcm-url", url, "--exit-at-end"),
                *("--reorder-delay-ms", options.reorder_delay_ms),
            ],
            folder / "estimator.log",
        )
        started.append(estimator)
        (folder / "live.lcm").unlink(missing_ok=True)
        logger = ["lcm-logger", f"--lcm-url={url}", folder / "live.lcm"]
        logger = Process("lcm-logger", logger, folder / "logger.log")
        started.append(logger)
        if options.view:
            view = options.view.split()
            started.append(Process("viewer", view, folder / "view.log", LCM_DEFAULT_URL=url))
        time.sleep(2)
        driver = Process(
            "loc-driver",
            [
                *(options.programs / "loc-driver", "--lcm-url", url, "--wait-for-estimator", "20"),
                *("euroc", recording, "--images", "--format", "jpeg"),
            ],
            folder / "driver.log",
        )
        started.append(driver)
        begin, sixths = time.monotonic(), 0
        while driver.process.poll() is None and time.monotonic() - begin < 2 * seconds + 60:
            time.sleep(0.5)
            note = time.monotonic() - begin > (sixths + 1) * seconds / 6
            sixths += note
            for process in started:
                process.look(note)
        wall = time.monotonic() - begin
        try:
            code = estimator.process.wait(20)
        except subprocess.TimeoutExpired:
            code = estimator.end()
        driver_code = driver.process.poll()
    finally:
        for process in reversed(started):
            process.end()
    return report(started, driver, estimator, code, driver_code, wall, folder, options)


def write_rig(programs, folder):
    rig = folder / "rig.yaml"
    run(
        [
            *(programs / "loc-simulate", "--scenario", "circle", "--duration", "1s"),
            *("--set", f"camera.rate_hz={RATE_HZ}", "--write-rig", rig),
        ]
    )
    return rig


def latencies_in(log):
    """From the arrival of a picture to the log's of its pose [ms], and how many messages each channel has."""
    found, channels = [], {}
    for event in lcm.EventLog(str(log), "r"):
        channels[event.channel] = channels.get(event.channel, 0) + 1
        if event.channel == "LOC_SLAM_FRAME":
            _, host_time_ns = struct.unpack_from(">qq", event.data, 8)  # behind the fingerprint
            found.append((host_time_ns * 1e-9, event.timestamp * 1e-3 - host_time_ns * 1e-6))
    return np.array(found).reshape(-1, 2), channels


def told(lines):
    return " ".join(f"{k}={v}" for k, v in lines.items() if k not in ("time", "level", "program", "pid"))


def report(started, driver, estimator, code, driver_code, wall, folder, options):
    sent, got = driver.last("ended"), estimator.last("ended")
    print(f"driver: {told(sent)}\nestimator: {told(got)}")
    for process in started:
        memory = " ".join(f"{kb / 1024:.1f}" for kb in [*process.memory_each_kb, process.memory_kb])
        print(f"{process.name:14s} CPU {100 * process.cpu_s / wall:5.1f} % of one core, memory {memory} MB")
    size = (folder / "live.lcm").stat().st_size / 1e6
    print(f"log {size:.0f} MB, {wall:.0f} s, load of the machine {os.getloadavg()[0]:.1f}")
    missed = []
    if code != 0 or driver_code != 0:
        missed.append(f"exit codes: loc-estimator {code}, loc-driver {driver_code}; log lines in {folder}")
    poses, channels = latencies_in(folder / "live.lcm")
    # Pictures of the time at rest wait for the start, which is found once the body was seen to rest.
    started_up = poses[:, 0] > poses[:1, 0] + START_S
    latency, early_latency = poses[started_up, 1], poses[~started_up, 1]
    for stream, channel in (("imu", "LOC_IMU"), ("image", "LOC_IMAGE")):
        published = int(sent.get(f"{stream}.published", 0))
        received = sum(int(v) for k, v in got.items() if re.fullmatch(rf"{stream}\d*\.received", k))
        logged = channels.get(channel, 0)
        print(f"{stream}: {published} published, {received} received, {logged} logged")
        if published == 0 or received != published or logged != published:
            missed.append(f"{stream}: {received} received and {logged} logged of {published}")
    drops = {
        k: v
        for k, v in got.items()
        if re.search(r"dropped$|\.late$|^(imu|image)\d*\.lost$", k) and v not in ("0", "0.000")
    }
    if drops:
        missed.append(f"dropped: {drops}")
    if len(latency) == 0:
        missed.append("no picture has a pose")
    else:
        p50, p99 = np.percentile(latency, [50, 99])
        print(
            f"picture to pose: {len(latency)}, p50 {p50:.1f}, p99 {p99:.1f}, max {latency.max():.1f} ms; "
            f"in the first {START_S} s max {early_latency.max():.1f} ms"
        )
        if p99 > MAX_P99_MS:
            missed.append(f"latency p99 {p99:.1f} ms > {MAX_P99_MS} ms")
    early, late = (estimator.memory_each_kb or [0])[0], estimator.memory_kb
    if not early or late > 1.05 * early:
        missed.append(f"memory of loc-estimator: {early} -> {late} kB")
    for text in missed:
        print(f"MISSED {text}")
    if not missed:
        print("ok")
        if options.work is None:
            shutil.rmtree(folder)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
