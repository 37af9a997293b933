"""Hardware in the loop: scanner telegrams, NMEA sentences, serial ports, and a schedule that keeps time."""
