"""Emulator: an IS-900 that plays readings in real time, for drivers and third-party programs (docs/device.md,
Emulator).

`Device` is the device without input or output. `Emulator` adds a serial line and its faults. `serve_emulator` serves it
at a port."""
