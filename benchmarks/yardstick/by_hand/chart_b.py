"""Chart B in Python by hand: match and case over leaves and events, with inherited transitions."""

from __future__ import annotations


class Data:
    """The variables of the chart."""

    __slots__ = ("c", "faults", "n", "parts", "ticks")

    def __init__(self) -> None:
        self.n = 0
        self.faults = 0
        self.parts = 0
        self.ticks = 0
        self.c = [0] * 20

    def values(self) -> list[int]:
        """Return all variables in the order of the digests."""
        return [self.n, self.faults, self.parts, self.ticks, *self.c]


class ChartB:
    """The machine; states and events are numbers."""

    __slots__ = ("data", "state")

    def __init__(self) -> None:
        self.data = Data()
        self.state = 0
        self.data.c[0] += 1

    def send(self, event: int) -> None:
        """Process an event."""
        data = self.data
        match self.state:
            case 0:  # Off
                match event:
                    case 0:  # POWER_ON
                        data.c[1] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
            case 1:  # Homing
                match event:
                    case 1:  # POWER_OFF
                        data.c[5] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 2:  # HOMED
                        data.c[5] += 1
                        data.c[6] += 1
                        self.state = 2
                    case 8:  # FAULT
                        data.c[5] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[5] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        data.ticks = data.ticks + 1
            case 2:  # Idle
                match event:
                    case 1:  # POWER_OFF
                        data.c[7] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 3:  # START
                        if data.n < 200:
                            data.c[7] += 1
                            data.n = data.n + 1
                            data.c[8] += 1
                            data.c[10] += 1
                            self.state = 3
                            return
                        data.n = 0
                    case 8:  # FAULT
                        data.c[7] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[7] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        data.ticks = data.ticks + 1
            case 3:  # Moving
                match event:
                    case 1:  # POWER_OFF
                        data.c[11] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 4:  # ARRIVED
                        data.c[11] += 1
                        data.c[12] += 1
                        self.state = 4
                    case 7:  # STOP
                        data.c[11] += 1
                        data.c[9] += 1
                        data.c[16] += 1
                        self.state = 6
                    case 8:  # FAULT
                        data.c[11] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[11] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        if data.n > 0:
                            data.n = data.n - 1
                            return
                        data.ticks = data.ticks + 1
            case 4:  # Waiting
                match event:
                    case 1:  # POWER_OFF
                        data.c[13] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 5:  # READY
                        if (data.n & 1) == 0:
                            data.c[13] += 1
                            data.c[14] += 1
                            self.state = 5
                            return
                        data.n = data.n + 1
                    case 7:  # STOP
                        data.c[13] += 1
                        data.c[9] += 1
                        data.c[16] += 1
                        self.state = 6
                    case 8:  # FAULT
                        data.c[13] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[13] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        if data.n > 0:
                            data.n = data.n - 1
                            return
                        data.ticks = data.ticks + 1
            case 5:  # Handshake
                match event:
                    case 1:  # POWER_OFF
                        data.c[15] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 6:  # DONE
                        if (data.parts & 7) == 7:
                            data.c[15] += 1
                            data.c[9] += 1
                            data.parts = data.parts + 1
                            data.c[6] += 1
                            self.state = 2
                            return
                        data.c[15] += 1
                        data.parts = data.parts + 1
                        data.n = data.n + 2
                        data.c[10] += 1
                        self.state = 3
                    case 7:  # STOP
                        data.c[15] += 1
                        data.c[9] += 1
                        data.c[16] += 1
                        self.state = 6
                    case 8:  # FAULT
                        data.c[15] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[15] += 1
                        data.c[9] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        if data.n > 0:
                            data.n = data.n - 1
                            return
                        data.ticks = data.ticks + 1
            case 6:  # Stopping
                match event:
                    case 1:  # POWER_OFF
                        data.c[17] += 1
                        data.c[3] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 8:  # FAULT
                        data.c[17] += 1
                        data.c[3] += 1
                        data.faults = data.faults + 1
                        data.c[18] += 1
                        self.state = 7
                    case 9:  # RESET
                        data.c[17] += 1
                        data.c[3] += 1
                        data.c[2] += 1
                        data.c[4] += 1
                        self.state = 1
                    case 10:  # TICK
                        data.c[17] += 1
                        data.c[6] += 1
                        self.state = 2
            case 7:  # Error
                match event:
                    case 1:  # POWER_OFF
                        data.c[19] += 1
                        data.c[0] += 1
                        self.state = 0
                    case 9:  # RESET
                        if (data.faults & 1) == 1:
                            data.c[19] += 1
                            data.c[2] += 1
                            data.c[4] += 1
                            self.state = 1
                            return
                        data.c[19] += 1
                        data.c[0] += 1
                        self.state = 0
