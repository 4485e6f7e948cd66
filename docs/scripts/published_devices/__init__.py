"""The devices that the 3UPU wrist is compared with, as URDF with closures files, all on the arm of one man."""

from .device_files import DEVICES, device_texts

__all__ = ["DEVICES", "device_texts"]
