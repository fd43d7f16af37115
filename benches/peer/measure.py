"""Runs one command and appends its resource use to a table: name, wall s, CPU s, peak memory in KiB.

    python measure.py TABLE NAME COMMAND [ARGUMENT ...]

CPU seconds are user and system time of all threads. The output of the command is shown only if it
fails. Linux; standard library only.
"""

import os
import resource
import subprocess
import sys
import tempfile
import threading
import time

POLL_S = 0.005


class PeakWatcher(threading.Thread):
    """Reads the peak memory of a process while it runs.

    The value that wait4 gives is at least the memory of this very interpreter, because the child
    starts out in it. A process smaller than that is seen only from its own record, which never
    falls, so that no more than the growth in the last few milliseconds is missed.
    """

    def __init__(self, pid):
        super().__init__(daemon=True)
        self.status = open(f"/proc/{pid}/status", "rb", buffering=0)
        self.peak_kib = 0

    def run(self):
        try:
            while True:
                self.status.seek(0)
                for line in self.status.read(4096).splitlines():
                    if line.startswith(b"VmHWM:"):
                        self.peak_kib = int(line.split()[1])
                time.sleep(POLL_S)
        except OSError:
            return  # The process has ended.


def main():
    if len(sys.argv) < 4:
        sys.exit("usage: measure.py TABLE NAME COMMAND [ARGUMENT ...]")
    table, name, command = sys.argv[1], sys.argv[2], sys.argv[3:]
    with tempfile.TemporaryFile() as said:
        start = time.perf_counter()
        try:
            child = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        except OSError as error:
            sys.exit(f"{command[0]}: cannot start: {error.strerror}")
        watcher = PeakWatcher(child.pid)
        watcher.start()
        _, status, usage = os.wait4(child.pid, 0)
        wall_s = time.perf_counter() - start
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode != 0:
            said.seek(0)
            sys.stderr.write(said.read().decode(errors="replace"))
            sys.exit(f"{name} ended with code {child.returncode}")
    watcher.join()
    floor_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    peak_kib = usage.ru_maxrss if usage.ru_maxrss > floor_kib else watcher.peak_kib
    with open(table, "a", encoding="ascii") as file:
        cpu_s = usage.ru_utime + usage.ru_stime
        file.write(f"{name}\t{wall_s:.6f}\t{cpu_s:.6f}\t{peak_kib}\n")


if __name__ == "__main__":
    main()
