"""Java in the form that Rhapsody generates, beside the import of the same machine.

``python -m devtools.foreign java FOLDER`` does this with projects that hold generated Java.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from devtools.foreign.generated_java import comparison, generated_classes
from tests.foreign.rhapsody.archives import archive, default, move, state
from tests.needs import tool

MACHINE = """package door;
import com.ibm.rational.rhapsody.oxf.*;
import com.ibm.rational.rhapsody.oxf.states.*;
public class Door implements RiJStateConcept {
    public Reactive reactive;
    public static final int RiJNonState=0;
    public static final int open=1;
    public static final int closed=2;
    int rootState_active;
    public Door(RiJThread p_thread) { reactive = new Reactive(p_thread); }
    public class Reactive extends RiJStateReactive {
        public Reactive(RiJThread p_thread) { super(p_thread); }
        public boolean isIn(int state) { return rootState_active == state; }
        public void rootState_entDef() { closed_entDef(); }
        public int rootState_dispatchEvent(short id) {
            return rootState_active == open ? open_takeEvent(id) : closed_takeEvent(id);
        }
        public int open_takeEvent(short id) {
            int res = RiJStateReactive.TAKE_EVENT_NOT_CONSUMED;
            if(event.isTypeOf(RiJEvent.TIMEOUT_EVENT_ID) && event.getTimeoutId() == 7)
                {
                    itsRiJThread.unschedTimeout(7, this);
                    closed_entDef();
                    res = RiJStateReactive.TAKE_EVENT_COMPLETE;
                }
            return res;
        }
        public int closed_takeEvent(short id) {
            int res = RiJStateReactive.TAKE_EVENT_NOT_CONSUMED;
            if(event.isTypeOf(1))
                {
                    //## transition 1
                    if(isAllowed())
                        {
                            //#[ transition 1
                            bell.ring();
                            getLamp().gen(new evOn());
                            //#]
                            rootState_active = open;
                            itsRiJThread.schedTimeout(1500, 7, this);
                            res = RiJStateReactive.TAKE_EVENT_COMPLETE;
                        }
                }
            return res;
        }
        public void closed_entDef() { rootState_active = closed; }
    }
}
"""
EVENT = """package door;
public class evPush extends com.ibm.rational.rhapsody.oxf.RiJEvent {
    public evPush() { lId = 1; }
}
"""


@pytest.mark.external
@pytest.mark.cc
@pytest.mark.parametrize("delay", [1500, 1000])
def test_the_import_does_what_the_java_does(tmp_path: Path, delay: int) -> None:
    tool("javac")
    action = "bell.ring(); getLamp().gen(new evOn());"
    unit = archive(
        [state("closed"), state("open")],
        [default("root", "closed"), move("open", "closed", trigger="tm(1500)"),
         move("closed", "open", trigger="evPush", guard="isAllowed()", action=action)],
    )  # fmt: skip
    project = tmp_path / "project"
    (project / "door").mkdir(parents=True)
    (project / "door.rpy").write_text("")
    (project / "door.sbs").write_text(unit)
    (project / "door" / "Door.java").write_text(MACHINE.replace("(1500,", f"({delay},"))
    (project / "door" / "evPush.java").write_text(EVENT)
    (one,) = generated_classes(project)
    verdict = comparison(one, 60, tmp_path / "build")
    assert (verdict == "no difference") == (delay == 1500), verdict


def test_java_of_another_version_is_not_compared(tmp_path: Path) -> None:
    unit = archive(
        [state("closed"), state("open")],
        [default("root", "closed"), move("closed", "open", trigger="evPush", action="shout();")],
    )
    (tmp_path / "door.rpy").write_text("")
    (tmp_path / "door.sbs").write_text(unit)
    (tmp_path / "Door.java").write_text(MACHINE)
    (one,) = generated_classes(tmp_path)
    assert "has not the content of shout" in comparison(one, 1, tmp_path / "build")
