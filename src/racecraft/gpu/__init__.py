"""A GPU as Racecraft needs one: CUDA source compiled at run time, memory, launches. Knows nothing of cars."""

from racecraft.gpu.compiler import compile_program
from racecraft.gpu.device import Array, CudaDevice, Device, DeviceArray, open_device

__all__ = ["Array", "CudaDevice", "Device", "DeviceArray", "compile_program", "open_device"]
