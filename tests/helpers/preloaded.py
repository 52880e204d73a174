"""What the processes of sessions import and load, in the process from which tests fork them (`conftest`)."""

from underfoot.engine import compiler, process, recorder  # noqa: F401
from underfoot.engine.kernel_loading import load_common_kernels

load_common_kernels()
