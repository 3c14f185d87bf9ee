"""Chart A in Python by hand: match and case over states and events."""

from __future__ import annotations


class Data:
    """The variables of the chart."""

    __slots__ = ("n",)

    def __init__(self) -> None:
        self.n = 0

    def values(self) -> list[int]:
        """Return all variables in the order of the digests."""
        return [self.n]


class ChartA:
    """The machine; states and events are numbers."""

    __slots__ = ("data", "state")

    def __init__(self) -> None:
        self.data = Data()
        self.state = 0

    def send(self, event: int) -> None:
        """Process an event."""
        data = self.data
        match self.state:
            case 0:  # S0
                match event:
                    case 0:  # E0
                        data.n = data.n + 1
                        self.state = 1
                    case 1:  # E1
                        if (data.n & 1) == 0:
                            data.n = data.n + 3
                            self.state = 2
                    case 2:  # E2
                        if data.n > 40:
                            data.n = data.n - 17
                            self.state = 7
                    case 3:  # E3
                        data.n = data.n + 2
            case 1:  # S1
                match event:
                    case 1:  # E1
                        data.n = data.n + 1
                        self.state = 2
                    case 2:  # E2
                        if (data.n & 1) == 1:
                            data.n = data.n + 3
                            self.state = 3
                    case 3:  # E3
                        if data.n > 48:
                            data.n = data.n - 18
                            self.state = 0
                    case 4:  # E4
                        data.n = data.n + 2
            case 2:  # S2
                match event:
                    case 2:  # E2
                        data.n = data.n + 1
                        self.state = 3
                    case 3:  # E3
                        if (data.n & 1) == 0:
                            data.n = data.n + 3
                            self.state = 4
                    case 4:  # E4
                        if data.n > 56:
                            data.n = data.n - 19
                            self.state = 1
                    case 5:  # E5
                        data.n = data.n + 2
            case 3:  # S3
                match event:
                    case 3:  # E3
                        data.n = data.n + 1
                        self.state = 4
                    case 4:  # E4
                        if (data.n & 1) == 1:
                            data.n = data.n + 3
                            self.state = 5
                    case 5:  # E5
                        if data.n > 64:
                            data.n = data.n - 20
                            self.state = 2
                    case 6:  # E6
                        data.n = data.n + 2
            case 4:  # S4
                match event:
                    case 4:  # E4
                        data.n = data.n + 1
                        self.state = 5
                    case 5:  # E5
                        if (data.n & 1) == 0:
                            data.n = data.n + 3
                            self.state = 6
                    case 6:  # E6
                        if data.n > 72:
                            data.n = data.n - 21
                            self.state = 3
                    case 7:  # E7
                        data.n = data.n + 2
            case 5:  # S5
                match event:
                    case 0:  # E0
                        data.n = data.n + 2
                    case 5:  # E5
                        data.n = data.n + 1
                        self.state = 6
                    case 6:  # E6
                        if (data.n & 1) == 1:
                            data.n = data.n + 3
                            self.state = 7
                    case 7:  # E7
                        if data.n > 80:
                            data.n = data.n - 22
                            self.state = 4
            case 6:  # S6
                match event:
                    case 0:  # E0
                        if data.n > 88:
                            data.n = data.n - 23
                            self.state = 5
                    case 1:  # E1
                        data.n = data.n + 2
                    case 6:  # E6
                        data.n = data.n + 1
                        self.state = 7
                    case 7:  # E7
                        if (data.n & 1) == 0:
                            data.n = data.n + 3
                            self.state = 0
            case 7:  # S7
                match event:
                    case 0:  # E0
                        if (data.n & 1) == 1:
                            data.n = data.n + 3
                            self.state = 1
                    case 1:  # E1
                        if data.n > 96:
                            data.n = data.n - 24
                            self.state = 6
                    case 2:  # E2
                        data.n = data.n + 2
                    case 7:  # E7
                        data.n = data.n + 1
                        self.state = 0
