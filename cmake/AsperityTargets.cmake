# Targets of the project: one library a module, one test program a module, all with the same warnings.

find_program(ASPERITY_CCACHE ccache)
if(ASPERITY_CCACHE AND NOT CMAKE_CXX_COMPILER_LAUNCHER)
  set(CMAKE_CXX_COMPILER_LAUNCHER "${ASPERITY_CCACHE}")
endif()

# What a tick runs through is built with -O3; all else is built to be built quickly. The modules that are hot:
set(ASPERITY_HOT_MODULES core geometry field material surface render device servo)

# The sources of a target are compiled in a few large units, since most of what a source costs are its headers: in
# as many as keep two cores busy. OFF: each by itself, for editors and clang-tidy.
option(ASPERITY_UNITY "Compile the sources of a target in a few large units" ON)
function(asperity_units target units)
  if(NOT ASPERITY_UNITY)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  list(LENGTH sources count)
  math(EXPR batch "(${count} + ${units} - 1) / ${units}")
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE BATCH UNITY_BUILD_BATCH_SIZE ${batch})
endfunction()

# asperity_cold(TARGET): nothing in it is run thousands of times a second.
function(asperity_cold target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-Og>)
endfunction()

add_library(asperity_build_settings INTERFACE)
if(PROJECT_IS_TOP_LEVEL)
  target_compile_options(asperity_build_settings INTERFACE
    -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wold-style-cast -Wnon-virtual-dtor -Woverloaded-virtual -Werror
    # GCC 12 reports false positives here inside Eigen and std::variant at -O2.
    $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
  # Files that share a unit see one another's names: a local variable may be called as another file's function, and what
  # is in an anonymous namespace is no header's.
  # (Collecting garbage costs GCC a tenth of its time, to save memory that two compilers at a time do not need.)
  target_compile_options(asperity_build_settings INTERFACE
    $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1048576>)
  if(ASPERITY_UNITY)
    target_compile_options(asperity_build_settings INTERFACE
      $<$<CXX_COMPILER_ID:GNU>:-Wshadow=local -Wno-subobject-linkage>)
  else()
    target_compile_options(asperity_build_settings INTERFACE -Wshadow)
  endif()
endif()
if(ASPERITY_SANITIZE)
  target_compile_options(asperity_build_settings INTERFACE -fsanitize=${ASPERITY_SANITIZE} -fno-omit-frame-pointer)
  if(ASPERITY_SANITIZE STREQUAL "thread")
    # It does not see fences, of which one makes a mesh's old snapshot ours: no test under it moves a mesh.
    target_compile_options(asperity_build_settings INTERFACE -Wno-tsan)
  endif()
  target_link_options(asperity_build_settings INTERFACE -fsanitize=${ASPERITY_SANITIZE})
  target_compile_definitions(asperity_build_settings INTERFACE ASPERITY_SANITIZED)
endif()

# asperity_inlined(TARGET): nothing of Eigen's small vectors is left as a call. GCC leaves some, which cost a tick more
# than what they do. And two components of such a vector are not joined in pairs: what was written one by one and is read
# as a pair makes the processor wait. (Not for `field`, whose wide kernels then round their sums otherwise from one to
# the other, and whose polynomials gain from pairs.)
set(ASPERITY_INLINED_MODULES geometry material surface render)
function(asperity_inlined target)
  target_compile_definitions(${target} PRIVATE
    "$<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:EIGEN_STRONG_INLINE=inline __attribute__((always_inline))>")
  target_compile_options(${target} PRIVATE
    $<$<AND:$<CONFIG:Release>,$<CXX_COMPILER_ID:GNU>>:-fno-tree-slp-vectorize>)
endfunction()

# asperity_module(NAME UNITS n [SOURCES files...] [FOLDERS folders...] DEPENDS modules... LIBRARIES public... PRIVATE private...)
# A library from every .cpp in the current folder, in its detail/ and in its FOLDERS (or from those given), with the alias asperity::NAME. Headers in detail/
# are the module's own: no other module includes them, and they are not installed.
function(asperity_module name)
  cmake_parse_arguments(arg "" "UNITS" "SOURCES;FOLDERS;DEPENDS;LIBRARIES;PRIVATE" ${ARGN})
  set(sources ${arg_SOURCES})
  if(NOT sources)
    set(places "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
    foreach(folder IN LISTS arg_FOLDERS ITEMS detail)
      list(APPEND places "${CMAKE_CURRENT_SOURCE_DIR}/${folder}/*.cpp")
    endforeach()
    file(GLOB sources CONFIGURE_DEPENDS ${places})
  endif()
  add_library(asperity_${name} STATIC ${sources})
  add_library(asperity::${name} ALIAS asperity_${name})
  set_target_properties(asperity_${name} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(asperity_${name} PUBLIC cxx_std_20)
  target_include_directories(asperity_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:include>)
  foreach(module IN LISTS arg_DEPENDS)
    target_link_libraries(asperity_${name} PUBLIC asperity_${module})
  endforeach()
  target_link_libraries(asperity_${name} PUBLIC ${arg_LIBRARIES})
  target_link_libraries(asperity_${name} PRIVATE $<BUILD_INTERFACE:asperity_build_settings> ${arg_PRIVATE})
  asperity_units(asperity_${name} ${arg_UNITS})
  if(NOT name IN_LIST ASPERITY_HOT_MODULES)
    asperity_cold(asperity_${name})
  endif()
  if(name IN_LIST ASPERITY_INLINED_MODULES)
    asperity_inlined(asperity_${name})
  endif()
  set_property(GLOBAL APPEND PROPERTY ASPERITY_MODULES asperity_${name})
  if(ASPERITY_INSTALL)
    install(TARGETS asperity_${name} EXPORT asperityTargets ARCHIVE)
  endif()
endfunction()

# asperity_test(NAME UNITS n LIBRARIES ...): one test program from every .cpp in the current folder.
function(asperity_test name)
  cmake_parse_arguments(arg "" "UNITS" "LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  add_executable(asperity_${name}_tests ${sources})
  target_include_directories(asperity_${name}_tests PRIVATE "${PROJECT_SOURCE_DIR}")
  target_link_libraries(asperity_${name}_tests PRIVATE ${arg_LIBRARIES} GTest::gtest_main asperity_build_settings)
  asperity_units(asperity_${name}_tests ${arg_UNITS})
  target_compile_options(asperity_${name}_tests PRIVATE $<$<CONFIG:Release>:-O1>)
  target_compile_definitions(asperity_${name}_tests PRIVATE
    ASPERITY_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ASPERITY_SHARED_DATA="${PROJECT_SOURCE_DIR}/../shared/data")
  gtest_discover_tests(asperity_${name}_tests DISCOVERY_MODE PRE_TEST PROPERTIES LABELS ${name} TIMEOUT 600
    # The same random cases every time; for new ones run the program itself, or set RC_PARAMS.
    ENVIRONMENT "RC_PARAMS=seed=20261121")
endfunction()
