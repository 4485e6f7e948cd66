"""The devices that the 3UPU wrist is compared with, as URDF with closures files, all on the arm of one man."""

from .device_files import DEVICES

__all__ = ["DEVICES"]
