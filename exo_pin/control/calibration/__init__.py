"""Joint centres, length offsets, the device's centre and sensor mountings from measured poses and limb lengths."""
