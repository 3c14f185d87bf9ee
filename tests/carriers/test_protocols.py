"""Each carrier implements its protocols: the types of these tables are checked by mypy."""

from __future__ import annotations

from fsmkit.carriers.can.plugin import PLUGIN as CAN
from fsmkit.carriers.in_process.plugin import PLUGIN as IN_PROCESS
from fsmkit.carriers.ros.plugin import PLUGIN as ROS
from fsmkit.carriers.wires.plugin import PLUGIN as WIRES
from fsmkit.carriers.zeromq.plugin import PLUGIN as ZEROMQ
from fsmkit.cli.writing.convert import NodeFiles
from fsmkit.codegen.system.files import (
    CLibrary,
    DeploymentFiles,
    DeploymentPackage,
    TimingReport,
)
from fsmkit.plugins import plugins
from fsmkit.runtime.links.link import LinkKind, TranslatorKind
from fsmkit.system.deployment.carrier import Carrier, Delaying, ForeignCarrier
from tests.carriers.toy.fsmkit_files.plugin import PLUGIN as FILES

LINKING: tuple[Carrier, ...] = (CAN, ROS, ZEROMQ, FILES)
OPENING: tuple[LinkKind, ...] = (CAN, IN_PROCESS, ROS, ZEROMQ, FILES)
FOREIGN: tuple[ForeignCarrier, ...] = (CAN, ROS)
TRANSLATING: tuple[TranslatorKind, ...] = (CAN, ROS)
DELAYING: tuple[Delaying, ...] = (CAN,)
WRITING: tuple[DeploymentFiles, ...] = (CAN, ROS)
TIMING: tuple[TimingReport, ...] = (CAN,)
PACKING: tuple[DeploymentPackage, ...] = (ROS,)
LIBRARIES: tuple[CLibrary, ...] = (CAN, IN_PROCESS, ROS, WIRES, ZEROMQ)
DESCRIBING: tuple[NodeFiles, ...] = (CAN,)


def test_plug_ins_are_found_by_their_protocols() -> None:
    assert plugins(Carrier) == LINKING[:-1]
    assert plugins(LinkKind) == OPENING[:-1]
    assert plugins(ForeignCarrier) == FOREIGN
    assert plugins(TranslatorKind) == TRANSLATING
    assert plugins(Delaying) == DELAYING
    assert plugins(DeploymentFiles) == WRITING
    assert plugins(TimingReport) == TIMING
    assert plugins(DeploymentPackage) == PACKING
    assert plugins(CLibrary) == LIBRARIES
    assert plugins(NodeFiles) == DESCRIBING


def test_what_opens_links_has_a_carrier_of_the_same_name() -> None:
    """But for the kind that only programs name."""
    assert {kind.name for kind in OPENING} - {carrier.name for carrier in LINKING} == {"in_process"}
    assert {kind.name for kind in TRANSLATING} == {carrier.name for carrier in FOREIGN}
