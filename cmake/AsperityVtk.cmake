# VTK, where it is wanted and found: ASPERITY_VTK_FOUND, and VTK_LIBRARIES to link with. Only asperity/io/vtk and its
# tests use it; the installed libraries do not.

set(ASPERITY_VTK_FOUND FALSE)
if(NOT ASPERITY_WITH_VTK STREQUAL "OFF")
  set(needed)
  if(ASPERITY_WITH_VTK STREQUAL "ON")
    set(needed REQUIRED)
  endif()
  # Without components its Qt parts would be asked for. Its remarks on what it does not find are not ours.
  set(quiet_before "${CMAKE_MESSAGE_LOG_LEVEL}")
  set(CMAKE_MESSAGE_LOG_LEVEL ERROR)
  find_package(VTK 9.1 QUIET ${needed} COMPONENTS
    CommonCore CommonDataModel CommonExecutionModel FiltersCore FiltersGeneral
    IOCore IOGeometry IOImage IOLegacy IOXML IOParallelXML)
  set(CMAKE_MESSAGE_LOG_LEVEL "${quiet_before}")
  if(VTK_FOUND)
    set(ASPERITY_VTK_FOUND TRUE)
  endif()
endif()
# scripts/build asks whether configuring again would find what was installed since.
set(ASPERITY_VTK_WAS_FOUND "${ASPERITY_VTK_FOUND}" CACHE INTERNAL "Whether VTK was found")
