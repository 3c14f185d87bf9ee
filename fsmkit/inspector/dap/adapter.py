"""The debug adapter: converts requests to responses and events, without streams and clocks.

Each request gets one response. Steps caused by the request, by time, or by another client of the
hub follow as events.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import msgspec

from fsmkit.diagnostics import FsmkitError, Severity, fail, render
from fsmkit.diagnostics.as_json import as_json
from fsmkit.emit import plain
from fsmkit.inspector.commands import wrong
from fsmkit.inspector.dap import requests as ask
from fsmkit.inspector.dap.framing import decode_body
from fsmkit.inspector.dap.inspection import Inspection
from fsmkit.inspector.dap.launching import launch
from fsmkit.inspector.dap.session import Session
from fsmkit.inspector.dap.stops import FILTERS
from fsmkit.inspector.hub import Hub

Json = dict[str, Any]
CAPABILITIES = (
    "supportsBreakpointLocationsRequest",
    "supportsCompletionsRequest",
    "supportsConditionalBreakpoints",
    "supportsConfigurationDoneRequest",
    "supportsDataBreakpoints",
    "supportsDelayedStackTraceLoading",
    "supportsEvaluateForHovers",
    "supportsExceptionInfoRequest",
    "supportsFunctionBreakpoints",
    "supportsHitConditionalBreakpoints",
    "supportsLoadedSourcesRequest",
    "supportsLogPoints",
    "supportsRestartFrame",
    "supportsSetVariable",
    "supportsStepBack",
    "supportsSteppingGranularity",
    "supportsTerminateRequest",
)


LIVE = "fsmkit/live"
"""The request for the address of a page; no part of the protocol."""


class Adapter:
    """The adapter of one editor.

    Args:
        send: Function that sends a message to the editor.
        hub: A running session for `attach`; without it, `launch` starts one.
        may_command: Whether the editor may give commands.
        wakes: Called when the hub has news; call `look` soon afterwards.

    """

    def __init__(
        self,
        send: Callable[[Json], None],
        *,
        hub: Hub | None = None,
        may_command: bool = True,
        wakes: Callable[[], None] = lambda: None,
    ) -> None:
        self.is_over = False
        """Whether the editor is gone: it is sent nothing more."""
        self.page_wanted: Hub | None = None
        """The session of which a page is to be served: `page_served` answers the editor."""
        self._page_asked = 0
        self._send = send
        self._given = hub
        self._may_command = may_command
        self._wakes = wakes
        self._seq = 0
        self._client: ask.Initialize | None = None
        self._session: Session | None = None
        self._later: list[tuple[str, Json]] | None = None
        """Events that wait for the answer to a request."""

    @property
    def hub(self) -> Hub | None:
        """The session started by this editor, which needs `advance`."""
        return None if self._session is None or self._given is not None else self._session.hub

    def receive(self, body: bytes) -> None:
        """Receive the body of a frame and respond to it."""
        try:
            found = decode_body(body)
        except ValueError as error:
            self._reject(0, "", wrong(f"this is not JSON: {error}"))
            return
        if isinstance(found, dict) and found.get("type") in ("response", "event"):
            return
        try:
            request = msgspec.convert(found, ask.Request)
        except (ValueError, RecursionError) as error:
            seq = found.get("seq") if isinstance(found, dict) else 0
            self._reject(seq if isinstance(seq, int) else 0, "", wrong(f"no request: {error}"))
            return
        self._later = []
        self._answer(request)
        later, self._later = self._later, None
        for event in later:
            self._event(*event)
        self.look()
        if request.command == "disconnect":
            self.close()

    def look(self) -> None:
        """Send the editor the steps since the last call."""
        if self._session is not None and not self.is_over:
            self._session.look()

    def page_served(self, address: str | FsmkitError) -> None:
        """Respond with the address of the requested page, or with the reason why there is none."""
        self.page_wanted = None
        if isinstance(address, str):
            outcome = {"success": True, "body": {"address": address}}
            self._respond(self._page_asked, LIVE, outcome)
        else:
            self._reject(self._page_asked, LIVE, address)

    def broken(self, reason: str) -> None:
        """End the session: the stream of the editor cannot be split into messages any more."""
        self._event("output", {"category": "important", "output": f"fsmkit: {reason}\n"})
        self._event("terminated", {})
        self.close()

    def close(self) -> None:
        """Leave the session; a server's session continues."""
        if self._session is not None:
            self._session.close()
            self._session = None
        self.is_over = True

    # --- messages --------------------------------------------------------------------------------

    def _answer(self, request: ask.Request) -> None:
        try:
            body = self._obeyed(request)
        except FsmkitError as error:
            self._reject(request.seq, request.command, error)
        except OSError as error:
            reason = (error.strerror or type(error).__name__).lower()
            self._reject(request.seq, request.command, fail("unreadable-file", reason))
        except Exception as error:
            text = f"fsmkit has a bug: {type(error).__name__}: {error}"
            self._respond(request.seq, request.command, {"success": False, "message": text})
            raise  # the command line writes the report
        else:
            if request.command != LIVE:
                self._respond(request.seq, request.command, {"success": True, "body": body})
            else:
                self._page_asked = request.seq

    def _obeyed(self, request: ask.Request) -> Json:
        name = request.command
        if name not in OF_ADAPTER and name not in OF_SESSION and name not in OF_INSPECTION:
            raise wrong(f"there is no request `{name}`")
        if self._client is None and name != "initialize":
            raise wrong(f"`{name}` comes before `initialize`")
        if name in OF_ADAPTER:
            kind, handler = OF_ADAPTER[name]
            return handler(self, _arguments(request, kind))
        if self._session is None:
            raise wrong("nothing runs yet", "`launch` a chart, a system or a counterexample")
        if name in OF_SESSION:
            kind, of_session = OF_SESSION[name]
            return of_session(self._session, _arguments(request, kind))
        kind, of_inspection = OF_INSPECTION[name]
        return of_inspection(self._session.inspection, _arguments(request, kind))

    def _reject(self, seq: int, command: str, error: FsmkitError) -> None:
        """Answer with a finding: as text for people, and as data."""
        errors = [each for each in error.diagnostics if each.severity is Severity.ERROR]
        shown = errors or list(error.diagnostics)
        told = {
            "id": int(shown[0].rule.code.lstrip("FK")),
            "format": "{text}",  # braces in a text name no variables
            "variables": {"text": "\n\n".join(plain(render(each)) for each in shown)},
            "showUser": True,
        }
        body = {"error": told, "findings": [as_json(each) for each in error.diagnostics]}
        message = plain(shown[0].message)
        self._respond(seq, command, {"success": False, "message": message, "body": body})

    def _respond(self, seq: int, command: str, outcome: Json) -> None:
        self._put({"type": "response", "request_seq": seq, "command": command, **outcome})

    def _event(self, name: str, body: Json) -> None:
        if self._later is not None:
            self._later.append((name, body))
        else:
            self._put({"type": "event", "event": name, "body": body})

    def _put(self, message: Json) -> None:
        if not self.is_over:
            self._seq += 1
            self._send({"seq": self._seq, **message})

    # --- requests --------------------------------------------------------------------------------

    def initialize(self, given: ask.Initialize) -> Json:
        """Return the capabilities of the adapter."""
        self._client = given
        return {
            **dict.fromkeys(CAPABILITIES, True),
            "completionTriggerCharacters": [" ", ".", "("],
            "exceptionBreakpointFilters": [
                {"filter": name, "label": title, "description": means, "default": is_default}
                for name, title, means, is_default in FILTERS
            ],
        }

    def launch(self, given: ask.Launch) -> Json:
        """Start a session of a file."""
        if self._given is not None:
            raise wrong("a session runs here already", "`attach` to it")
        if self._session is None:
            begun = launch(given)
            for each in begun.remarks:
                text = plain(render(each))
                self._event("output", {"category": "stderr", "output": f"{text}\n\n"})
            return self._begin(begun.hub, given)
        raise wrong("a session has already started", "`disconnect`, and start another adapter")

    def attach(self, given: ask.Launch) -> Json:
        """Join a session that runs."""
        if self._given is None:
            help_ = "start `fsmkit serve FILE --dap PORT`, and let the editor connect to that port"
            raise wrong("no session runs here", help_)
        if self._session is None:
            return self._begin(self._given, given)
        raise wrong("a session has already started", "`disconnect` first")

    def _begin(self, hub: Hub, given: ask.Launch) -> Json:
        client = self._client or ask.Initialize()
        self._session = Session(
            hub, given, client, self._event, may_command=self._may_command, wakes=self._wakes
        )
        self._event("initialized", {})
        return {}

    def terminate(self, given: ask.Nothing) -> Json:
        """End, as far as the editor is concerned; it may still look."""
        del given
        self._event("terminated", {})
        return {}

    def disconnect(self, given: ask.Nothing) -> Json:
        """End; `receive` closes."""
        del given
        return {}

    def live(self, given: ask.Nothing) -> Json:
        """Ask for a page of the same session; it is answered by `page_served`."""
        del given
        if self._session is None:
            raise wrong("there is no session to show in a page", "`launch` one first")
        if self.page_wanted is not None:
            raise wrong("a page is being served already")
        self.page_wanted = self._session.hub
        return {}


def _arguments(request: ask.Request, kind: type[Any]) -> Any:
    try:
        return msgspec.convert(request.arguments or {}, kind)
    except (ValueError, RecursionError) as error:
        raise wrong(f"arguments of `{request.command}`: {error}") from error


OF_ADAPTER: dict[str, tuple[type[Any], Callable[[Adapter, Any], Json]]] = {
    "initialize": (ask.Initialize, Adapter.initialize),
    "launch": (ask.Launch, Adapter.launch),
    "attach": (ask.Launch, Adapter.attach),
    "terminate": (ask.Nothing, Adapter.terminate),
    "disconnect": (ask.Nothing, Adapter.disconnect),
    LIVE: (ask.Nothing, Adapter.live),
}
OF_SESSION: dict[str, tuple[type[Any], Callable[[Session, Any], Json]]] = {
    "configurationDone": (ask.Nothing, Session.begin),
    "setBreakpoints": (ask.SourceBreakpoints, Session.in_source),
    "breakpointLocations": (ask.Lines, Session.locations),
    "setFunctionBreakpoints": (ask.Breakpoints, Session.on_functions),
    "setExceptionBreakpoints": (ask.Filters, Session.on_exceptions),
    "setDataBreakpoints": (ask.Breakpoints, Session.on_data),
    "dataBreakpointInfo": (ask.DataInfo, Session.data_info),
    "exceptionInfo": (ask.Thread, Session.exception_info),
    "continue": (ask.Thread, Session.go_on),
    "pause": (ask.Thread, Session.pause),
    "next": (ask.Stepping, Session.next),
    "stepIn": (ask.Stepping, Session.step_in),
    "stepOut": (ask.Stepping, Session.step_out),
    "stepBack": (ask.Stepping, Session.step_back),
    "reverseContinue": (ask.Thread, Session.reverse),
    "restartFrame": (ask.OfFrame, Session.restart_frame),
}
OF_INSPECTION: dict[str, tuple[type[Any], Callable[[Inspection, Any], Json]]] = {
    "threads": (ask.Nothing, Inspection.threads),
    "stackTrace": (ask.Stack, Inspection.stack),
    "scopes": (ask.OfFrame, Inspection.scopes),
    "variables": (ask.Variables, Inspection.variables),
    "setVariable": (ask.SetVariable, Inspection.set_variable),
    "evaluate": (ask.Evaluate, Inspection.evaluate),
    "completions": (ask.Completions, Inspection.completions),
    "source": (ask.Source, Inspection.source),
    "loadedSources": (ask.Nothing, Inspection.sources),
}
