"""Tasks for workers: one that is well, and those that raise, die, stall or eat memory; they import little."""

import os
import signal
import time


def square(number):
    return number * number


def wrong(_):
    raise ValueError("no such room")


def broken(_):
    raise KeyError("x")


def dies(_):
    os.kill(os.getpid(), signal.SIGKILL)


def stalls(_):
    time.sleep(60)


def eats(_):
    held = b"x" * (400 * 2**20)
    time.sleep(60)
    return len(held)
