"""One GPU through the CUDA driver: memory, programs, launches on a stream.

Anything with the methods of `Device` will do in its place: the tests run the same kernels on the CPU.
"""

from __future__ import annotations

import weakref
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from racecraft.errors import ConfigError, RacecraftError
from racecraft.extras import needed_for
from racecraft.gpu.compiler import cache_folder, compile_program

NO_GPU: Final = "Use device 'cpu'; for a GPU install NVIDIA's driver and check it with nvidia-smi."


class Array(Protocol):
    """An array of the device; torch.as_tensor, CuPy and Numba take it without a copy."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the array."""

    @property
    def dtype(self) -> np.dtype[Any]:
        """Of its elements."""


class Device(Protocol):
    """Where kernels run."""

    name: str

    def load(
        self, source: str, *, name: str, kernels: Iterable[str], include: Path | None, defines: Mapping[str, object]
    ) -> None:
        """Compile a program and keep its kernels by name."""

    def allocate(self, size: int) -> int:
        """Address of new memory, zeros; it lives as long as the device object."""

    def array(self, address: int, shape: tuple[int, ...], dtype: DTypeLike) -> Any:
        """The memory at an address as an array."""

    def write(self, address: int, data: NDArray[Any]) -> None:
        """Copy to the device."""

    def read(self, address: int, size: int) -> NDArray[np.uint8]:
        """Copy so many bytes from the device, after all that was launched."""

    def fill(self, address: int, value: int, size: int, *, stream: int = 0) -> None:
        """Set bytes, in the order of the stream."""

    def launch(
        self, kernel: str, *, blocks: int, threads: int, batch: NDArray[np.uint8], input: int, extra: int, stream: int
    ) -> None:
        """Run a kernel of two addresses beside a struct that is passed by value, in the order of the stream."""


class DeviceArray:
    """Memory of a GPU, described by ``__cuda_array_interface__``: ``torch.as_tensor(array)`` shares it.

    Args:
        device: Whose memory it is; kept alive.
        address: Where.
        shape: Of the array, C-contiguous.
        dtype: Of its elements.
    """

    def __init__(self, device: CudaDevice, address: int, shape: tuple[int, ...], dtype: DTypeLike) -> None:
        self._device = device
        self.address = address
        self.shape = shape
        self.dtype = np.dtype(dtype)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        # An empty array has address 0, as the protocol wants it.
        address = self.address if all(self.shape) else 0
        return {
            "shape": self.shape,
            "typestr": self.dtype.str,
            "data": (address, False),
            "version": 3,
            "strides": None,
            "stream": None,
        }

    def numpy(self) -> NDArray[Any]:
        """A copy on the host, after all that was launched."""
        size = int(np.prod(self.shape)) * self.dtype.itemsize
        return self._device.read(self.address, size).view(self.dtype).reshape(self.shape)


class CudaDevice:
    """A GPU, in the context that torch uses as well.

    Args:
        index: Which of several.

    Raises:
        ConfigError: There is no GPU or no driver, or cuda-bindings is not installed.
    """

    def __init__(self, index: int = 0) -> None:
        with needed_for("Device 'cuda'"):
            from cuda.bindings import driver
        self._driver = driver
        try:
            self._check(driver.cuInit(0))
            (count,) = self._check(driver.cuDeviceGetCount())
        except RacecraftError as error:
            raise ConfigError(f"Device 'cuda' was asked for, but {error}", hint=NO_GPU) from error
        except RuntimeError as error:  # no driver library at all
            raise ConfigError(
                "Device 'cuda' was asked for, but this machine has no NVIDIA driver.", hint=NO_GPU
            ) from error
        if not 0 <= index < count:
            raise ConfigError(f"GPU number {index} was asked for, but this machine has {count}.", hint=NO_GPU)
        (self._device,) = self._check(driver.cuDeviceGet(index))
        (context,) = self._check(driver.cuDevicePrimaryCtxRetain(self._device))
        self._check(driver.cuCtxSetCurrent(context))
        self._context = context
        major, minor = (
            self._check(driver.cuDeviceGetAttribute(attribute, self._device))[0]
            for attribute in (
                driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR,
                driver.CUdevice_attribute.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR,
            )
        )
        self.architecture = f"sm_{major}{minor}"
        text = self._check(driver.cuDeviceGetName(256, self._device))[0]
        self.name = text.split(b"\0")[0].decode()
        self._kernels: dict[str, Any] = {}
        self._memory: list[Any] = []
        weakref.finalize(self, _release, driver, context, self._memory)

    def load(
        self, source: str, *, name: str, kernels: Iterable[str], include: Path | None, defines: Mapping[str, object]
    ) -> None:
        """Compile a program, or take it from the cache, and keep its kernels by name."""
        code = compile_program(
            source,
            name=name,
            architecture=self.architecture,
            include=include,
            defines=defines,
            cache=cache_folder(),
        )
        driver = self._driver
        (module,) = self._check(driver.cuModuleLoadData(code))
        for kernel in kernels:
            (self._kernels[kernel],) = self._check(driver.cuModuleGetFunction(module, kernel.encode()))

    def allocate(self, size: int) -> int:
        """Address of new memory, zeros."""
        driver = self._driver
        try:
            (pointer,) = self._check(driver.cuMemAlloc(max(size, 256)))
        except RacecraftError as error:
            raise ConfigError(
                f"The GPU has no room for another {size / 2**20:,.0f} MiB: {error}", hint="Use fewer cars."
            ) from error
        self._memory.append(pointer)
        self._check(driver.cuMemsetD8(pointer, 0, max(size, 256)))
        return int(pointer)

    def array(self, address: int, shape: tuple[int, ...], dtype: DTypeLike) -> DeviceArray:
        """The memory at an address as an array."""
        return DeviceArray(self, address, shape, dtype)

    def write(self, address: int, data: NDArray[Any]) -> None:
        """Copy to the device."""
        data = np.ascontiguousarray(data)
        if data.nbytes:
            self._check(self._driver.cuMemcpyHtoD(address, data.ctypes.data, data.nbytes))

    def read(self, address: int, size: int) -> NDArray[np.uint8]:
        """Copy so many bytes from the device, after all that was launched."""
        data = np.empty(size, np.uint8)
        self._check(self._driver.cuCtxSynchronize())
        if size:
            self._check(self._driver.cuMemcpyDtoH(data.ctypes.data, address, size))
        return data

    def fill(self, address: int, value: int, size: int, *, stream: int = 0) -> None:
        """Set bytes, in the order of the stream."""
        self._check(self._driver.cuMemsetD8Async(address, value, size, stream))

    def launch(
        self, kernel: str, *, blocks: int, threads: int, batch: NDArray[np.uint8], input: int, extra: int, stream: int
    ) -> None:
        """Run a kernel, in the order of the stream; its parameters are copied before this returns."""
        addresses = np.array([input, extra], np.uint64)
        parameters = np.array(
            [batch.ctypes.data, addresses.ctypes.data, addresses.ctypes.data + addresses.itemsize], np.uint64
        )
        self._check(
            self._driver.cuLaunchKernel(
                self._kernels[kernel], blocks, 1, 1, threads, 1, 1, 0, stream, parameters.ctypes.data, 0
            )
        )

    def _check(self, result: tuple[Any, ...]) -> tuple[Any, ...]:
        """What a call of the driver gave besides its status."""
        driver, status = self._driver, result[0]
        if status != driver.CUresult.CUDA_SUCCESS:
            _, text = driver.cuGetErrorString(status)
            raise RacecraftError(f"CUDA reports {status.name}: {text.decode() if text else 'unknown error'}.")
        return result[1:]


def _release(driver: Any, context: Any, memory: list[Any]) -> None:
    """Give the memory back; at the end of the process the driver may be gone already."""
    if driver.cuCtxSetCurrent(context)[0] != driver.CUresult.CUDA_SUCCESS:
        return
    driver.cuCtxSynchronize()
    for pointer in memory:
        driver.cuMemFree(pointer)


def open_device(name: str = "cuda") -> CudaDevice:
    """The GPU called ``cuda``, or ``cuda:1`` where there are several.

    Raises:
        ConfigError: The name is another one, or there is no such GPU.
    """
    kind, _, number = name.partition(":")
    if kind != "cuda" or (number and not number.isdecimal()):
        raise ConfigError(f"device is {name!r}; allowed are 'cuda' and 'cuda:0', 'cuda:1', ....")
    return CudaDevice(int(number or 0))
