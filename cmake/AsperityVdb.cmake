# OpenVDB, where it is wanted and found: ASPERITY_OPENVDB_FOUND, and OpenVDB::openvdb to link with. Only
# asperity/io/vdb and its tests use it; the installed libraries do not. To be included before VTK is looked for, which
# otherwise fails on TBB's targets.

set(ASPERITY_OPENVDB_FOUND FALSE)
if(NOT ASPERITY_WITH_OPENVDB STREQUAL "OFF")
  set(needed)
  if(ASPERITY_WITH_OPENVDB STREQUAL "ON")
    set(needed REQUIRED)
  endif()
  # Its remarks on what it does not find are not ours.
  set(quiet_before "${CMAKE_MESSAGE_LOG_LEVEL}")
  set(CMAKE_MESSAGE_LOG_LEVEL ERROR)
  find_package(TBB CONFIG QUIET ${needed})
  # The package's own find module asks for this without being quiet about it, and ends the configuring.
  find_package(Boost QUIET ${needed} COMPONENTS iostreams)
  find_path(ASPERITY_OPENVDB_HEADERS openvdb/version.h)
  mark_as_advanced(ASPERITY_OPENVDB_HEADERS)
  if(ASPERITY_WITH_OPENVDB STREQUAL "ON" OR (TBB_FOUND AND Boost_FOUND AND ASPERITY_OPENVDB_HEADERS))
    # Debian keeps the find module beside the library.
    list(PREPEND CMAKE_MODULE_PATH "/usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB")
    find_package(OpenVDB 10 QUIET ${needed} COMPONENTS openvdb)
    list(POP_FRONT CMAKE_MODULE_PATH)
  endif()
  set(CMAKE_MESSAGE_LOG_LEVEL "${quiet_before}")
  if(OpenVDB_FOUND AND TARGET OpenVDB::openvdb)
    set(ASPERITY_OPENVDB_FOUND TRUE)
  endif()
endif()
# scripts/build asks whether configuring again would find what was installed since.
set(ASPERITY_OPENVDB_WAS_FOUND "${ASPERITY_OPENVDB_FOUND}" CACHE INTERNAL "Whether OpenVDB was found")
