"""Models: functions and kernels on arrays, independent of graphs, files, clocks and devices."""
