# Helpers that give every target the same language level, warnings and include root.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/bin)

find_program(SCANRIG_CCACHE ccache)
if(SCANRIG_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${SCANRIG_CCACHE})
endif()

set(SCANRIG_SANITIZE "" CACHE STRING "Value for -fsanitize=, or empty")

add_compile_options(-pthread)  # for all alike, or a precompiled header does not fit

add_library(scanrig_warnings INTERFACE)
target_compile_options(scanrig_warnings INTERFACE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                                                  -Wnon-virtual-dtor -Wold-style-cast)
# Same bits on every dispatch level: the compiler must not contract a*b+c.
target_compile_options(scanrig_warnings INTERFACE -ffp-contract=off)
if(SCANRIG_SANITIZE)
  add_compile_options(-fsanitize=${SCANRIG_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${SCANRIG_SANITIZE})
endif()

# One precompiled header for all (precompiled.h), one more for tests; clang's tools do without.
option(SCANRIG_PRECOMPILE "Precompile the headers that most sources include" ON)
if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  set(SCANRIG_PRECOMPILE OFF)
endif()
if(SCANRIG_PRECOMPILE AND SCANRIG_CCACHE)
  add_compile_options(-fpch-preprocess)  # ccache needs this option with a precompiled header
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${SCANRIG_CCACHE})
endif()

# Sources of one library or test are compiled together: half of the work. So their names without a linkage differ.
option(SCANRIG_UNITY "Compile the sources of a library or test together" ON)
set(CMAKE_UNITY_BUILD_BATCH_SIZE 24)

# scanrig_precompiled(NAME HEADERS ... LINK libs [OPTIONS ...]): the target whose precompiled header others use, with
# the same options.
function(scanrig_precompiled name)
  cmake_parse_arguments(ARG "" "" "HEADERS;LINK;OPTIONS" ${ARGN})
  file(GENERATE OUTPUT ${CMAKE_BINARY_DIR}/generated/${name}.cpp CONTENT "")
  add_library(${name} OBJECT ${CMAKE_BINARY_DIR}/generated/${name}.cpp)
  target_link_libraries(${name} PRIVATE ${ARG_LINK} scanrig_warnings)
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
endfunction()

function(scanrig_use_precompiled target name)
  if(SCANRIG_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

# Targets that read or write JSON or command lines have those headers precompiled, too.
function(scanrig_use_precompiled_for target)
  if("nlohmann_json::nlohmann_json" IN_LIST ARGN OR "CLI11::CLI11" IN_LIST ARGN)
    scanrig_use_precompiled(${target} scanrig_precompiled_text_headers)
  else()
    scanrig_use_precompiled(${target} scanrig_precompiled_headers)
  endif()
endfunction()

# scanrig_library(NAME SOURCES a.cpp ... [LINK public libs] [PRIVATE private libs])
# Makes the static library `scanrig_NAME` (or an INTERFACE library when it has no sources), alias `scanrig::NAME`.
function(scanrig_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE" ${ARGN})
  if(ARG_SOURCES)
    add_library(scanrig_${name} STATIC ${ARG_SOURCES})
    target_include_directories(scanrig_${name} PUBLIC ${CMAKE_SOURCE_DIR})
    target_link_libraries(scanrig_${name} PUBLIC ${ARG_LINK} PRIVATE ${ARG_PRIVATE} scanrig_warnings)
    scanrig_use_precompiled_for(scanrig_${name} ${ARG_LINK} ${ARG_PRIVATE})
    set_target_properties(scanrig_${name} PROPERTIES UNITY_BUILD ${SCANRIG_UNITY})
  else()
    add_library(scanrig_${name} INTERFACE)
    target_include_directories(scanrig_${name} INTERFACE ${CMAKE_SOURCE_DIR})
    target_link_libraries(scanrig_${name} INTERFACE ${ARG_LINK})
  endif()
  add_library(scanrig::${name} ALIAS scanrig_${name})
endfunction()

# scanrig_program(NAME SOURCES main.cpp ... LINK libs)
function(scanrig_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} scanrig_warnings)
  scanrig_use_precompiled_for(${name} ${ARG_LINK})
endfunction()

# Time-out of a test in seconds; the test that may take longest starts first. Under a sanitizer everything is several
# times slower, in an emulator of another processor ten times.
function(scanrig_time_limit test seconds)
  if(SCANRIG_SANITIZE)
    math(EXPR seconds "8 * ${seconds}")
  elseif(CMAKE_CROSSCOMPILING)
    math(EXPR seconds "16 * ${seconds}")
    set_property(TEST ${test} APPEND PROPERTY ENVIRONMENT SCANRIG_EMULATED=1)
  endif()
  set_tests_properties(${test} PROPERTIES TIMEOUT ${seconds} COST ${seconds})
endfunction()

# Test code is not optimised: that would take half of the compile time. Tests that render or compute are optimised.
set(SCANRIG_QUICK_TO_COMPILE -O0)
set(SCANRIG_TESTS_THAT_COMPUTE "/tests/(unit|component)/(core|pipeline|sim|reconstruct|movement)(/|$)")

# scanrig_test(NAME LABEL unit|component|system SOURCES a_test.cpp ... LINK libs [TIMEOUT seconds] [REAL_TIME | WAITS])
# Both are for tests with deadlines of tens of milliseconds on a wire. REAL_TIME: no other test runs at the same time.
# WAITS: it computes little; ./dev test runs it after all others, beside one of its kind.
function(scanrig_test name)
  cmake_parse_arguments(ARG "REAL_TIME;WAITS" "LABEL;TIMEOUT" "SOURCES;LINK" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LINK} GTest::gtest GTest::gmock GTest::gtest_main scanrig_warnings)
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "${SCANRIG_TESTS_THAT_COMPUTE}")
    scanrig_use_precompiled(${name} scanrig_precompiled_optimised_test_headers)
  else()
    target_compile_options(${name} PRIVATE ${SCANRIG_QUICK_TO_COMPILE})
    scanrig_use_precompiled(${name} scanrig_precompiled_test_headers)
  endif()
  set_target_properties(${name} PROPERTIES UNITY_BUILD ${SCANRIG_UNITY})
  target_compile_definitions(${name} PRIVATE SCANRIG_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL})
  scanrig_time_limit(${name} ${ARG_TIMEOUT})
  if(ARG_REAL_TIME)
    set_tests_properties(${name} PROPERTIES RUN_SERIAL ON)
  elseif(ARG_WAITS)
    set_property(TEST ${name} APPEND PROPERTY LABELS waits)
  endif()
endfunction()

# Adds every folder below the current one that has a CMakeLists.txt, in the order given, the rest by name.
function(scanrig_add_folders)
  file(GLOB lists RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} CONFIGURE_DEPENDS */CMakeLists.txt)
  foreach(list ${lists})
    get_filename_component(folder ${list} DIRECTORY)
    add_subdirectory(${folder})
  endforeach()
endfunction()
