"""What a run finds: a line per service, on standard output and in the file of results."""

import time

FAILED = []
RESULTS = []


def write_into(path):
    """From now on results go into this file."""
    RESULTS.append(open(path, "w", encoding="utf-8"))


def write(service, verdict, remark):
    if verdict == "failed":
        FAILED.append(service)
    print(f"{service:40}{verdict:8}{remark}", flush=True)
    for results in RESULTS:
        print(service, verdict, remark, sep="\t", file=results, flush=True)


def report(service, try_it):
    try:
        verdict, remark = "ok", try_it() or ""
    except Exception as error:  # of any kind: it goes into the table
        verdict, remark = "failed", f"{type(error).__name__}: {error}".replace("\n", " ")
    write(service, verdict, remark)


def same(got, expected):
    if got != expected:
        raise AssertionError(f"{got!r} instead of {expected!r}")


def eventually(what, condition, seconds=3.0):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"no {what}")
        time.sleep(0.005)
