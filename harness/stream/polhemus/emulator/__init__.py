"""What emulators of trackers share: settings, samples that are played, a serial line with faults, ports, the server."""
