# fsmkit for CMake: find_package(fsmkit REQUIRED), with -Dfsmkit_DIR="$(fsmkit paths cmake)".
#
#   fsmkit_add_machine(<target> <chart> [PREFIX <prefix>] [DEPENDS <file>...])
#
# Compiles a chart, or all machines of a system, to C and adds the C to a target; its headers are
# found by the target and by whoever links it. This happens when CMake configures, which it does
# again when a chart in the folder of <chart>, or a file of DEPENDS, has changed: other targets may
# include the headers without saying so, and files that did not change are not compiled again.
#
#   fsmkit::hosts     the headers of mailbox and hosts
#   fsmkit::posix     the POSIX host
#   fsmkit::cortex_m  the Cortex-M host

if(CMAKE_VERSION VERSION_LESS 3.19)
  set(fsmkit_FOUND FALSE)
  set(fsmkit_NOT_FOUND_MESSAGE "fsmkit needs CMake 3.19 or newer")
  return()
endif()

get_filename_component(FSMKIT_RUNTIME_DIR "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

find_program(FSMKIT_EXECUTABLE fsmkit
  HINTS
    "${FSMKIT_RUNTIME_DIR}/../../../../../../bin" # of an environment: lib/python3.x/site-packages
    "${FSMKIT_RUNTIME_DIR}/../../../.venv/bin"    # of a checkout
  DOC "The compiler of statecharts")
if(NOT FSMKIT_EXECUTABLE)
  set(fsmkit_FOUND FALSE)
  set(fsmkit_NOT_FOUND_MESSAGE
    "the command fsmkit is not on the PATH: name it by -DFSMKIT_EXECUTABLE=...")
  return()
endif()

cmake_policy(PUSH)
cmake_policy(VERSION 3.19)

if(NOT TARGET fsmkit::hosts)
  add_library(fsmkit::hosts INTERFACE IMPORTED GLOBAL)
  set_target_properties(fsmkit::hosts PROPERTIES
    INTERFACE_INCLUDE_DIRECTORIES "${FSMKIT_RUNTIME_DIR}/hosts")

  set(THREADS_PREFER_PTHREAD_FLAG TRUE)
  find_package(Threads QUIET)
  if(TARGET Threads::Threads)
    add_library(fsmkit::posix INTERFACE IMPORTED GLOBAL)
    set_target_properties(fsmkit::posix PROPERTIES
      INTERFACE_SOURCES "${FSMKIT_RUNTIME_DIR}/hosts/posix/fsm_posix.c;${FSMKIT_RUNTIME_DIR}/hosts/posix/fsm_notify.c"
      INTERFACE_LINK_LIBRARIES "fsmkit::hosts;Threads::Threads")
  endif()

  add_library(fsmkit::cortex_m INTERFACE IMPORTED GLOBAL)
  set_target_properties(fsmkit::cortex_m PROPERTIES
    INTERFACE_SOURCES "${FSMKIT_RUNTIME_DIR}/hosts/cortex_m/fsm_cortex_m.c"
    INTERFACE_LINK_LIBRARIES fsmkit::hosts)
endif()

function(fsmkit_add_machine target chart)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "PREFIX" "DEPENDS")
  if(arg_UNPARSED_ARGUMENTS OR arg_KEYWORDS_MISSING_VALUES)
    message(FATAL_ERROR
      "fsmkit_add_machine(${target} ${chart}): what is `${arg_UNPARSED_ARGUMENTS}"
      "${arg_KEYWORDS_MISSING_VALUES}`? It takes PREFIX and DEPENDS.")
  endif()
  if(NOT TARGET ${target})
    message(FATAL_ERROR "fsmkit_add_machine: there is no target `${target}` yet")
  endif()
  get_property(languages GLOBAL PROPERTY ENABLED_LANGUAGES)
  if(NOT C IN_LIST languages)
    message(FATAL_ERROR "fsmkit_add_machine: machines are written in C: project(... LANGUAGES C)")
  endif()

  get_filename_component(chart "${chart}" ABSOLUTE)
  get_filename_component(folder "${chart}" DIRECTORY)
  file(GLOB charts CONFIGURE_DEPENDS
    "${folder}/*.scxml" "${folder}/*.xml" "${folder}/*.yaml" "${folder}/*.yml")
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${chart} ${charts} ${arg_DEPENDS})

  set(made "${CMAKE_CURRENT_BINARY_DIR}/fsmkit/${target}")
  set(fresh "${CMAKE_CURRENT_BINARY_DIR}/fsmkit/${target}.new")
  file(REMOVE_RECURSE "${fresh}")
  set(prefix)
  if(arg_PREFIX)
    set(prefix --prefix "${arg_PREFIX}")
  endif()
  execute_process(
    COMMAND "${FSMKIT_EXECUTABLE}" compile "${chart}" --out "${fresh}" ${prefix} --json
    OUTPUT_VARIABLE json ERROR_VARIABLE findings RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "fsmkit_add_machine(${target} ${chart}):\n${findings}")
  elseif(findings)
    message(STATUS "fsmkit: ${chart}\n${findings}")
  endif()

  get_property(before TARGET ${target} PROPERTY FSMKIT_FILES)
  string(JSON count LENGTH "${json}" files)
  math(EXPR last "${count} - 1")
  foreach(index RANGE ${last})
    string(JSON path GET "${json}" files ${index})
    file(RELATIVE_PATH name "${fresh}" "${path}")
    if(NOT name IN_LIST before)
      configure_file("${path}" "${made}/${name}" COPYONLY) # only if it differs
      target_sources(${target} PRIVATE "${made}/${name}")
      set_property(TARGET ${target} APPEND PROPERTY FSMKIT_FILES "${name}")
    else()
      file(SHA256 "${path}" new)
      file(SHA256 "${made}/${name}" old)
      if(NOT new STREQUAL old)
        message(FATAL_ERROR
          "fsmkit_add_machine(${target} ${chart}): another machine of this target is written to "
          "`${name}`; say PREFIX")
      endif()
    endif()
  endforeach()
  file(REMOVE_RECURSE "${fresh}")
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${made}>")
endfunction()

cmake_policy(POP)
