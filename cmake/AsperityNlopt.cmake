# NLopt, where it is wanted and found: ASPERITY_NLOPT_FOUND, and NLopt::nlopt to link with. Only asperity/study/nlopt
# and its tests use it; the installed libraries do not.

set(ASPERITY_NLOPT_FOUND FALSE)
if(NOT ASPERITY_WITH_NLOPT STREQUAL "OFF")
  set(needed)
  if(ASPERITY_WITH_NLOPT STREQUAL "ON")
    set(needed REQUIRED)
  endif()
  # Its C interface, which throws nothing (Debian: libnlopt-dev without libnlopt-cxx-dev).
  find_package(NLopt 2.6 CONFIG QUIET ${needed})
  if(NLopt_FOUND AND TARGET NLopt::nlopt)
    set(ASPERITY_NLOPT_FOUND TRUE)
  endif()
endif()
# scripts/build asks whether configuring again would find what was installed since.
set(ASPERITY_NLOPT_WAS_FOUND "${ASPERITY_NLOPT_FOUND}" CACHE INTERNAL "Whether NLopt was found")
