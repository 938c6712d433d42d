import os
import platform
import subprocess
import sys

import pytest

ROUNDS = """
import resource, sys
import numpy as np
from idem_ros.node.allocation import keep_freed_memory
keep_freed_memory()
for _ in range(4):
    begin = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    scans = [np.ones(1_000_000) for _ in range(6)]
    del scans
    print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - begin)
"""


def page_faults(**more):
    environment = {k: v for k, v in os.environ.items() if 'MALLOC' not in k} | more
    script = [sys.executable, '-c', ROUNDS]
    done = subprocess.run(script, env=environment, capture_output=True, text=True, check=True)
    return [int(each) for each in done.stdout.split()]


@pytest.mark.skipif(platform.libc_ver()[0] != 'glibc', reason='the C library is not glibc')
def test_scans_after_the_first_find_its_memory_unless_the_user_told_malloc_otherwise():
    first, *later = page_faults()
    assert max(later) < first / 10
    _, *told = page_faults(MALLOC_TRIM_THRESHOLD_='131072')
    assert min(told) > 10 * max(*later, 1)


@pytest.mark.skipif(platform.system() != 'Linux', reason='huge pages are of Linux')
def test_no_array_is_in_huge_pages():
    script = """
from idem_ros.node.allocation import take_small_pages
take_small_pages()
print(open('/proc/self/status').read())
"""
    done = subprocess.run(
        [sys.executable, '-c', script], capture_output=True, text=True, check=True
    )
    assert 'THP_enabled:\t0' in done.stdout
