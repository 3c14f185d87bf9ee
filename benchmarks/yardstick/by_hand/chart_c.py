"""Chart C in Python by hand: a number for each region. On TICK, regions move one by one."""

from __future__ import annotations


class Data:
    """The variables of the chart."""

    __slots__ = ("c", "n")

    def __init__(self) -> None:
        self.n = 0
        self.c = [0] * 44

    def values(self) -> list[int]:
        """Return all variables in the order of the digests."""
        return [self.n, *self.c]


class ChartC:
    """The machine; events and the states of each region are numbers."""

    __slots__ = ("data", "is_on", "region")

    def __init__(self) -> None:
        self.data = Data()
        self.is_on = False
        self.region = [0, 0, 0, 0]
        self.data.c[0] += 1

    def _switch_on(self) -> None:
        region = self.region
        c = self.data.c
        c[1] += 1
        c[2] += 1
        c[4] += 1
        c[6 + 2 * region[0]] += 1
        c[14] += 1
        c[16 + 2 * region[1]] += 1
        c[24] += 1
        c[26 + 2 * region[2]] += 1
        c[34] += 1
        c[36 + 2 * region[3]] += 1
        self.is_on = True

    def _switch_off(self) -> None:
        region = self.region
        c = self.data.c
        c[37 + 2 * region[3]] += 1
        c[35] += 1
        c[27 + 2 * region[2]] += 1
        c[25] += 1
        c[17 + 2 * region[1]] += 1
        c[15] += 1
        c[7 + 2 * region[0]] += 1
        c[5] += 1
        c[3] += 1
        self.is_on = False
        c[0] += 1

    def send(self, event: int) -> None:
        """Process an event."""
        data = self.data
        region = self.region
        if not self.is_on:
            if event == 0:  # ON
                region[:] = (0, 0, 0, 0)
                self._switch_on()
            elif event == 1:  # RESUME
                self._switch_on()
            return
        match event:
            case 2:  # OFF
                self._switch_off()
            case 3:  # TICK
                match region[0]:
                    case 0:
                        data.c[7] += 1
                        data.c[8] += 1
                        region[0] = 1
                    case 1:
                        if (data.n & 1) == 0:
                            data.c[9] += 1
                            data.c[10] += 1
                            region[0] = 2
                    case 2:
                        data.c[11] += 1
                        data.c[12] += 1
                        region[0] = 3
                    case 3:
                        data.c[13] += 1
                        data.c[6] += 1
                        region[0] = 0
                match region[1]:
                    case 0:
                        data.c[17] += 1
                        data.c[18] += 1
                        region[1] = 1
                    case 1:
                        if (data.n & 2) == 0:
                            data.c[19] += 1
                            data.c[20] += 1
                            region[1] = 2
                    case 2:
                        data.c[21] += 1
                        data.c[22] += 1
                        region[1] = 3
                    case 3:
                        data.c[23] += 1
                        data.c[16] += 1
                        region[1] = 0
                match region[2]:
                    case 0:
                        data.c[27] += 1
                        data.c[28] += 1
                        region[2] = 1
                    case 1:
                        if (data.n & 4) == 0:
                            data.c[29] += 1
                            data.c[30] += 1
                            region[2] = 2
                    case 2:
                        data.c[31] += 1
                        data.c[32] += 1
                        region[2] = 3
                    case 3:
                        data.c[33] += 1
                        data.c[26] += 1
                        region[2] = 0
                match region[3]:
                    case 0:
                        data.c[37] += 1
                        data.c[38] += 1
                        region[3] = 1
                    case 1:
                        if (data.n & 8) == 0:
                            data.c[39] += 1
                            data.c[40] += 1
                            region[3] = 2
                    case 2:
                        data.c[41] += 1
                        data.c[42] += 1
                        region[3] = 3
                    case 3:
                        data.c[43] += 1
                        data.c[36] += 1
                        region[3] = 0
            case 4:  # A0
                match region[0]:
                    case 0:
                        data.c[7] += 1
                        data.c[10] += 1
                        region[0] = 2
                    case 1:
                        if (data.n & 1) == 0:
                            data.c[9] += 1
                            data.c[12] += 1
                            region[0] = 3
                    case 2:
                        data.c[11] += 1
                        data.n = data.n + 1
                        data.c[6] += 1
                        region[0] = 0
                    case 3:
                        data.n = data.n + 1
            case 5:  # A1
                match region[1]:
                    case 0:
                        data.c[17] += 1
                        data.c[20] += 1
                        region[1] = 2
                    case 1:
                        if (data.n & 1) == 1:
                            data.c[19] += 1
                            data.c[22] += 1
                            region[1] = 3
                    case 2:
                        data.c[21] += 1
                        data.n = data.n + 2
                        data.c[16] += 1
                        region[1] = 0
                    case 3:
                        data.n = data.n + 1
            case 6:  # A2
                match region[2]:
                    case 0:
                        data.c[27] += 1
                        data.c[30] += 1
                        region[2] = 2
                    case 1:
                        if (data.n & 1) == 0:
                            data.c[29] += 1
                            data.c[32] += 1
                            region[2] = 3
                    case 2:
                        data.c[31] += 1
                        data.n = data.n + 3
                        data.c[26] += 1
                        region[2] = 0
                    case 3:
                        data.n = data.n + 1
            case 7:  # A3
                match region[3]:
                    case 0:
                        data.c[37] += 1
                        data.c[40] += 1
                        region[3] = 2
                    case 1:
                        if (data.n & 1) == 1:
                            data.c[39] += 1
                            data.c[42] += 1
                            region[3] = 3
                    case 2:
                        data.c[41] += 1
                        data.n = data.n + 4
                        data.c[36] += 1
                        region[3] = 0
                    case 3:
                        data.n = data.n + 1
            case 8:  # B0
                match region[0]:
                    case 1:
                        data.c[9] += 1
                        data.n = data.n + 2
                        data.c[6] += 1
                        region[0] = 0
                    case 3:
                        if data.n > 0:
                            data.c[13] += 1
                            data.n = data.n - 9
                            data.c[8] += 1
                            region[0] = 1
            case 9:  # B1
                match region[1]:
                    case 1:
                        data.c[19] += 1
                        data.n = data.n + 2
                        data.c[16] += 1
                        region[1] = 0
                    case 3:
                        if data.n > 8:
                            data.c[23] += 1
                            data.n = data.n - 14
                            data.c[18] += 1
                            region[1] = 1
            case 10:  # B2
                match region[2]:
                    case 1:
                        data.c[29] += 1
                        data.n = data.n + 2
                        data.c[26] += 1
                        region[2] = 0
                    case 3:
                        if data.n > 16:
                            data.c[33] += 1
                            data.n = data.n - 19
                            data.c[28] += 1
                            region[2] = 1
            case 11:  # B3
                match region[3]:
                    case 1:
                        data.c[39] += 1
                        data.n = data.n + 2
                        data.c[36] += 1
                        region[3] = 0
                    case 3:
                        if data.n > 24:
                            data.c[43] += 1
                            data.n = data.n - 24
                            data.c[38] += 1
                            region[3] = 1
