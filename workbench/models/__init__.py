"""The science: functions and kernels on arrays. Nothing here knows of a graph, a file, a clock or a device."""
