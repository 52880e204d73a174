"""Loading of what a session needs: what is made for the first time is counted, part by part."""

import gc

from underfoot.array_cache import ArrayCache
from underfoot.devices.device_floor import DeviceFloor
from underfoot.engine.kernel_loading import KernelParts
from underfoot.engine.loop import LoopOptions
from underfoot.engine.target import Target
from underfoot.floor import simulated_plates
from underfoot.floor.layout import default_floor
from underfoot.patch.patch import Patch


def test_each_plate_that_is_computed_is_a_part_and_none_is_computed_twice(monkeypatch, tmp_path):
    monkeypatch.setattr(simulated_plates, "_CACHE", ArrayCache(str(tmp_path)))
    options = LoopOptions(block=128, plates=("accelerometer",))
    told, told_again = [], []
    for reports in (told, told_again):
        KernelParts(Patch(), Target(default_floor(1, 4)), options).load(reports.append)
    total = told[-1].total
    assert [report.ready for report in told][-4:] == [*range(total - 3, total + 1)]  # three plates, and the rest
    assert told_again == []
    assert len(list(tmp_path.glob("*.npy"))) == 4


def test_from_the_end_plates_come_first_so_that_two_processes_share_them(monkeypatch, tmp_path):
    monkeypatch.setattr(simulated_plates, "_CACHE", ArrayCache(str(tmp_path)))
    options, told = LoopOptions(block=128, plates=("accelerometer",)), []
    KernelParts(Patch(), Target(default_floor(1, 2)), options, from_end=True).load(told.append)
    assert [report.ready for report in told][:2] == [1, 2]


def test_programs_of_a_floor_of_hardware_leave_nothing_to_the_collector():
    """Each cue of a floor of hardware left a megabyte or two, up to gigabytes: the collector counts objects."""
    floor = Target(default_floor(1, 1), "udp", "127.0.0.1:9000")
    there = []
    for _ in range(4):
        KernelParts(Patch(), floor, LoopOptions(block=128)).load(lambda _: None)
        there.append(sum(type(one) is DeviceFloor for one in gc.get_objects()))  # isinstance asks dead weak proxies
    assert there == there[:1] * 4
