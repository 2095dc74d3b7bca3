"""What drivers of trackers share: transports, the exchange over a line, the stations, the watchdog."""
