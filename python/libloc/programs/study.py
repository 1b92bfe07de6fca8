"""loc-study: Monte Carlo studies of libloc's estimators on its own simulator.

Each study runs an estimator with many seeds and prints its errors as a table; with --out they are also
written as CSV and JSON, with pictures. The same seeds give the same table, whatever the number of workers.
Runs go through dask.distributed: on all cores of this machine, or on the workers of --scheduler; --jobs 1
needs no dask.

Exit codes: 0 done, 1 the study could not run (the message says why), 2 wrong options, 130 interrupted: what
was finished by then is printed.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import libloc
from libloc import DataError
from libloc.programs import study_monoslam, study_vio
from libloc.programs.study_runner import StudyError, cores, progress, results

EXIT_OK, EXIT_FAILED, EXIT_USAGE, EXIT_INTERRUPTED = 0, 1, 2, 130

# A study is a module with NAME, HELP, add_options, tasks, run (one task, in whatever process), evaluate (of
# tasks and results in any order), text_of and write.
_STUDIES = {study.NAME: study for study in (study_monoslam, study_vio)}


def _positive(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text}: must be at least 1")
    return value


def make_parser() -> argparse.ArgumentParser:
    common = argparse.ArgumentParser(add_help=False)
    common.add_argument(
        "--seeds", type=_positive, default=30, metavar="N", help="number of runs (%(default)s)"
    )
    common.add_argument(
        "--first-seed", type=_positive, default=1, metavar="SEED", help="of the runs (%(default)s)"
    )
    where = common.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs",
        type=_positive,
        default=None,
        metavar="N",
        help="processes on this machine (default: one a core)",
    )
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a dask scheduler: tcp://host:8786")
    common.add_argument("--out", type=Path, metavar="DIR", help="write tables and pictures into this folder")
    parser = argparse.ArgumentParser(
        prog="loc-study", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--version", action="version", version=libloc.__version__)
    commands = parser.add_subparsers(dest="study", required=True, metavar="STUDY")
    for study in _STUDIES.values():
        sub = commands.add_parser(
            study.NAME,
            parents=[common],
            help=study.HELP,
            description=study.__doc__,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        study.add_options(sub)
    return parser


def main(arguments: list[str] | None = None) -> int:
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.out is not None and options.out.exists() and not options.out.is_dir():
        parser.error(f"--out {options.out}: is not a folder")
    study = _STUDIES[options.study]
    started = time.monotonic()
    interrupted = False
    finished = []
    try:
        tasks = study.tasks(options, range(options.first_seed, options.first_seed + options.seeds))
        if options.out is not None:
            options.out.mkdir(parents=True, exist_ok=True)  # before the work, not after it
        try:
            with progress(f"loc-study {study.NAME}", len(tasks)) as advance:
                for task, result in results(study.run, tasks, options.jobs or cores(), options.scheduler):
                    finished.append((task, result))
                    advance()
        except KeyboardInterrupt:
            interrupted = True
            print(
                f"loc-study: interrupted, {len(finished)} of {len(tasks)} runs are finished", file=sys.stderr
            )
            if not finished:
                return EXIT_INTERRUPTED
        outcome = study.evaluate(finished, options, interrupted)
        print(study.text_of(outcome))
        print(f"{len(finished)} runs in {time.monotonic() - started:.1f} s")
        if options.out is not None:
            for path in study.write(outcome, options.out):
                print(f"written: {path}")
    except (StudyError, DataError, ValueError, OSError) as error:
        print(f"loc-study: {error}", file=sys.stderr)
        return EXIT_FAILED
    return EXIT_INTERRUPTED if interrupted else EXIT_OK


if __name__ == "__main__":
    sys.exit(main())
