"""A package of ROS 2 for a deployment: its messages, and for each node a program by rclc.

``package.xml`` is format 3 (REP 149), ``CMakeLists.txt`` for ament_cmake. The programs need rclc,
which is part of micro-ROS, and do not allocate memory after their start.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from fsmkit.carriers.ros.definition_files import compose_ros
from fsmkit.carriers.ros.definitions import with_nested
from fsmkit.carriers.ros.messages import lower, package_name
from fsmkit.carriers.ros.network import ros_nodes
from fsmkit.carriers.ros.rclc_tables import compose_rclc, tables_of
from fsmkit.carriers.ros.topics import RosNode
from fsmkit.chart.analysis.host_events import sent_events
from fsmkit.codegen.c.header import parameters
from fsmkit.codegen.packages.packing import stub
from fsmkit.codegen.system.node import Node
from fsmkit.codegen.system.node_printer import NodePrinter
from fsmkit.codegen.system.parts import parts_of
from fsmkit.diagnostics import fail
from fsmkit.emit import Emitter, printing
from fsmkit.emit.c import comment
from fsmkit.emit.xml import escaped
from fsmkit.runtime.library import C_LIBRARY
from fsmkit.system.deployment.deployment import Deployment
from fsmkit.system.deployment.event_map import LevelType, MessageType

VERSION = "0.1.0"
"""The version of the package; its publisher numbers it."""
OWN = Path(__file__).parent / "c"
LIBRARY = (
    *(C_LIBRARY / "links" / name for name in ("fsm_link.h", "fsm_link.c")),
    OWN / "fsm_ros_values.h",
    *(OWN / "rclc" / name for name in ("fsm_link_rclc.h", "fsm_link_rclc.c")),
    C_LIBRARY / "hosts/fsm_mailbox.h",
    *(OWN / "rclc" / name for name in ("fsm_rclc_state.h", "fsm_rclc_state.c")),
    *(C_LIBRARY / "hosts" / name for name in ("fsm_shared.h", "fsm_watch.h")),
)

STATES = "std_msgs"
"""The package of the message that carries active states."""


def ros_package(
    deployment: Deployment, machines: Mapping[str, Mapping[str, str]], nodes: Sequence[Node]
) -> dict[str, str]:
    """Return the files; ``machines``: by node the C of its machines and their connections.

    Raises:
        FsmkitError: ``wrong-option`` if a node has no topic, or exchanges frames with another.

    """
    name = package_name(deployment.system.name)
    own = set(deployment.own_nodes)
    crossing: list[MessageType | LevelType] = [*deployment.map.messages, *deployment.map.levels]
    joined = next((wire for wire in crossing if {wire.sender, wire.receiver} <= own), None)
    if joined is not None:
        raise fail(
            "wrong-option",
            f"a package of ROS carries topics only, and `{joined.name}` joins two nodes of fsmkit",
            help="place their machines on one node, or compile without `--package`",
        )
    if silent := [node.name for node in nodes if not tables_of(node)]:
        raise fail(
            "wrong-option",
            f"`{silent[0]}` has no topic of ROS",
            help="connect its machines with those of a node with `foreign: ros`",
        )
    messages = {
        path: text for path, text in compose_ros(deployment).items() if path.startswith("msg/")
    }
    files = dict(messages)
    for node in nodes:
        folder = f"src/{_word(node)}"
        inner = dict(machines[node.name]) | compose_rclc(node)
        inner |= {"main.c": _main(node), "host.c": _host(node)}
        files |= {f"{folder}/{path}": text for path, text in inner.items()}
    for path in LIBRARY:
        files[f"src/link/{path.name}"] = path.read_text(encoding="utf-8")
    types = with_nested([type_ for ros in ros_nodes(deployment).values() for type_ in ros.types])
    used = ({type_.package for type_ in types} | {STATES}) - {name}
    domains = {ros.domain for ros in ros_nodes(deployment).values()}
    if len(domains) > 1:
        raise fail(
            "wrong-option",
            "a program by rclc is in one domain, and the nodes of ROS are in "
            f"{' and '.join(map(str, sorted(domains)))}",
            help="give them one `domain`",
        )
    files["package.xml"] = _manifest(name, deployment.system.name, sorted(used), messages)
    files["CMakeLists.txt"] = _cmake(name, sorted(used), sorted(messages), nodes, files)
    return files


def _word(node: Node) -> str:
    """Return the name of a node as a folder, other than that of each other node."""
    return node.words[node.place].lower()


@printing
def _host(node: Node) -> str:
    """Return the functions of unconnected ports: empty ones, to be filled in."""
    printer = NodePrinter(node, parts_of(node.system, node.charts, ()))
    joined = {(link.source, link.port) for link in node.system.event_links} | set(printer.sent)
    out = Emitter()
    out.line(
        f"/* host.c: the host functions of the machines of the node {comment(node.name)}, to be"
    )
    out.line(" * replaced. It belongs to whoever generated it, without any condition. */")
    out.lines([f'#include "{node.prefix}.h"', ""])
    printed: set[str] = set()
    for part in printer.parts:
        if part.prefix in printed:
            continue
        printed.add(part.prefix)
        names, chart = part.names, part.chart
        ports = {port for machine, port in joined if machine == part.index}
        for number, operation in enumerate(chart.operations):
            if len(chart.events) + number not in ports:
                name = names.operations[operation.name]
                stub(out, names, name, operation.parameters, operation.result)
        for index in sent_events(chart):
            if index not in ports:
                event = chart.events[index]
                stub(out, names, f"send_{names.event_names[index]}", event.fields, None)
    for name, part, fields in printer.host_functions():
        values = parameters(fields, part.names)
        with out.function(f"void {name}({node.prefix} *s{values})"):
            out.line("(void)s;")
            out.lines(f"(void){part.names.field(field.name)};" for field in fields)
    return out.finish()


@printing
def _main(node: Node) -> str:
    p, tables = node.prefix, tables_of(node)
    words = {peer: node.words[peer].lower() for peer in tables}
    ros = [ros_nodes(node.deployment)[peer] for peer in tables]
    comes = {w.topic.name for each in ros for w in each.wires if w.receiver == node.place}
    tick = node.system.machines[0].chart.capacities.tick
    out = Emitter()
    out.line(f"/* main.c: the node {comment(node.name)} by rclc, for micro-ROS.")
    out.line(" * It allocates nothing after its start. It belongs to whoever generated it. */")
    out.lines([f'#include "{p}.h"', f'#include "{p}_rclc.h"', '#include "fsm_rclc_state.h"', ""])
    out.lines(["#include <rcutils/time.h>", ""])
    out.line(f"enum {{ HANDLES = {max(1, len(comes))}, TICK_US = {tick} }};")
    out.line()
    out.lines(["static fsm_link wire;", f"static {p} machines;"])
    out.lines(f"static fsm_link_rclc topics_{word};" for word in words.values())
    opened = "\n".join(
        f"        fsm_link_rclc_open(&topics_{word}, &wire, &{tables[peer]}, &ros, &executor) !="
        f" RCL_RET_OK ||"
        for peer, word in words.items()
    )
    opened = opened.replace("        fsm", "fsm", 1)
    closed = "\n".join(f"    fsm_link_rclc_close(&topics_{word});" for word in words.values())
    name = lower(node.name)
    _states(out, node, ros)
    out.text(f"""

static uint32_t ticks(void)
{{
    rcutils_time_point_value_t now = 0;
    (void)rcutils_steady_time_now(&now);
    return (uint32_t)(now / 1000 / TICK_US);
}}

int main(int argc, char **argv)
{{
    rcl_allocator_t allocator = rcl_get_default_allocator();
    rcl_init_options_t options = rcl_get_zero_initialized_init_options();
    rclc_support_t support;
    rclc_executor_t executor = rclc_executor_get_zero_initialized_executor();
    rcl_node_t ros = rcl_get_zero_initialized_node();
    const uint32_t begin = ticks();
    if (rcl_init_options_init(&options, allocator) != RCL_RET_OK ||
        rcl_init_options_set_domain_id(&options, {ros[0].domain}u) != RCL_RET_OK ||
        rclc_support_init_with_options(&support, argc, (const char *const *)argv, &options,
                                       &allocator) != RCL_RET_OK ||
        rclc_node_init_default(&ros, "{name}", "", &support) != RCL_RET_OK ||
        rclc_executor_init(&executor, &support.context, HANDLES, &allocator) != RCL_RET_OK) {{
        return 1;
    }}
    /* better a stored counter: it distinguishes this run from earlier ones */
    fsm_link_init(&wire, &{p}_map, 1u + begin % 0x10000000u);
    if ({opened}
        open_states(&ros) != RCL_RET_OK ||
        rclc_executor_prepare(&executor) != RCL_RET_OK) {{ /* else the first call allocates */
        return 1;
    }}
    {p}_init(&machines);
    machines.link = &wire;
    (void){p}_start(&machines, 0u);
    show_states();
    while (rcl_context_is_valid(&support.context)) {{
        (void)rclc_executor_spin_some(&executor, RCL_MS_TO_NS(1));
        (void){p}_cycle(&machines, ticks() - begin);
        show_states();
    }}
    close_states(&ros);
{closed}
    (void)rclc_executor_fini(&executor);
    (void)rcl_node_fini(&ros);
    (void)rclc_support_fini(&support);
    (void)rcl_init_options_fini(&options);
    return 0;
}}
""")
    return out.finish()


def _states(out: Emitter, node: Node, ros: Sequence[RosNode]) -> None:
    """Print the functions that publish the active states of each machine, by foreign node."""
    parts = parts_of(node.system, node.charts, ())
    spaces = list(dict.fromkeys(each.namespace for each in ros))
    shown = [
        (part, f"{space}/{lower(machine.name)}/state")
        for space in spaces
        for part, machine in zip(parts, node.system.machines, strict=True)
    ]
    out.lines(["", "/* ---- active states; -DFSM_NO_NAMES omits them ---- */", ""])
    out.line("#ifndef FSM_NO_NAMES")
    out.line(f"static fsm_rclc_state shown[{len(shown)}];")
    out.line()
    with out.function("static rcl_ret_t open_states(const rcl_node_t *ros)"):
        with out.block("static const char *const topics[] = {", "};"):
            out.lines(f'"{topic}",' for _, topic in shown)
        out.line("rcl_ret_t code = RCL_RET_OK;")
        with out.block(f"for (size_t i = 0; i < {len(shown)}u && code == RCL_RET_OK; i++) {{"):
            out.line("code = fsm_rclc_state_open(&shown[i], ros, topics[i]);")
        out.line("return code;")
    out.line()
    with out.function("static void show_states(void)"):
        for place, (part, _) in enumerate(shown):
            with out.block("{"):
                p, room = part.prefix, len(part.names.plan.regions)
                out.line(f"{p}_state active[{room}];")
                out.line(
                    f"const uint16_t count = {p}_active(&machines.{part.member}, active, {room}u);"
                )
                out.line(f"fsm_rclc_state_begin(&shown[{place}]);")
                with out.block(f"for (uint16_t i = 0; i < count && i < {room}u; i++) {{"):
                    out.line(f"fsm_rclc_state_add(&shown[{place}], {p}_state_name(active[i]));")
                out.line(f"fsm_rclc_state_end(&shown[{place}]);")
    out.line()
    loop = f"for (size_t i = 0; i < {len(shown)}u; i++) {{"
    with out.function("static void close_states(rcl_node_t *ros)"), out.block(loop):
        out.line("fsm_rclc_state_close(&shown[i], ros);")
    out.line("#else")
    with out.function("static rcl_ret_t open_states(const rcl_node_t *ros)"):
        out.lines(["(void)ros;", "return RCL_RET_OK;"])
    with out.function("static void show_states(void)"):
        pass
    with out.function("static void close_states(rcl_node_t *ros)"):
        out.line("(void)ros;")
    out.line("#endif")


def _manifest(name: str, system: str, used: Sequence[str], messages: Mapping[str, str]) -> str:
    rows = [
        '<?xml version="1.0"?>',
        '<package format="3">',
        f"  <name>{name}</name>",
        f"  <version>{VERSION}</version>",
        f"  <description>The system {escaped(system)}, generated by fsmkit.</description>",
        '  <maintainer email="nobody@example.org">to be replaced</maintainer>',
        "  <license>to be replaced</license>",
        "  <buildtool_depend>ament_cmake</buildtool_depend>",
    ]
    if messages:
        rows += ["  <buildtool_depend>rosidl_default_generators</buildtool_depend>"]
    rows += [f"  <depend>{each}</depend>" for each in ("rclc", *used)]
    if messages:
        rows += ["  <exec_depend>rosidl_default_runtime</exec_depend>"]
        rows += ["  <member_of_group>rosidl_interface_packages</member_of_group>"]
    rows += ["  <export><build_type>ament_cmake</build_type></export>", "</package>"]
    return "\n".join(rows) + "\n"


def _cmake(
    name: str,
    used: Sequence[str],
    messages: Sequence[str],
    nodes: Sequence[Node],
    files: Mapping[str, str],
) -> str:
    out = Emitter()
    out.lines(["cmake_minimum_required(VERSION 3.16)", f"project({name} C CXX)"])
    packages = ["ament_cmake", "rclc", *used]
    packages += ["rosidl_default_generators"] if messages else []
    out.lines(f"find_package({each} REQUIRED)" for each in packages)
    if messages:
        out.line("rosidl_generate_interfaces(${PROJECT_NAME}")
        out.lines(f'  "{path}"' for path in messages)
        if "builtin_interfaces" in used:
            out.line("  DEPENDENCIES builtin_interfaces")
        out.line(")")
        out.line('rosidl_get_typesupport_target(messages ${PROJECT_NAME} "rosidl_typesupport_c")')
    for node in nodes:
        target, folder = f"node_{_word(node)}", f"src/{_word(node)}"
        sources = [p for p in sorted(files) if p.endswith(".c")]
        sources = [p for p in sources if p.startswith((f"{folder}/", "src/link/"))]
        out.line(f"add_executable({target}")
        out.lines(f"  {path}" for path in sources)
        out.line(")")
        out.line(f"set_target_properties({target} PROPERTIES C_STANDARD 99)")
        out.line(f"target_include_directories({target} PRIVATE {folder} src/link)")
        if messages:
            out.line(f'target_link_libraries({target} "${{messages}}")')
        out.line(f"ament_target_dependencies({target} {' '.join(['rclc', *used])})")
        out.line(f"install(TARGETS {target} DESTINATION lib/${{PROJECT_NAME}})")
    if messages:
        out.line("ament_export_dependencies(rosidl_default_runtime)")
    out.line("ament_package()")
    return out.finish()
