# Installs the build in BUILD into a folder of its own, then configures, builds and runs the project in CONSUMER with it.
# cmake -DBUILD=... -DCONSUMER=... -DFOLDER=... -DGENERATOR=... -DCOMPILER=... -DFLAGS=... -P install_and_use.cmake

function(must_succeed what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE code OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT code EQUAL 0)
    message(FATAL_ERROR "${what} failed (${code}):\n${output}")
  endif()
  message(STATUS "${what}: done")
endfunction()

file(REMOVE_RECURSE "${FOLDER}")
must_succeed("Installing" "${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${FOLDER}/prefix")
# The source tree must play no part any more: the consumer sees the prefix alone.
must_succeed("Configuring the consumer" "${CMAKE_COMMAND}" -S "${CONSUMER}" -B "${FOLDER}/build" -G "${GENERATOR}"
  "-DCMAKE_PREFIX_PATH=${FOLDER}/prefix" "-DCMAKE_CXX_COMPILER=${COMPILER}" "-DCMAKE_CXX_FLAGS=${FLAGS}")
must_succeed("Building the consumer" "${CMAKE_COMMAND}" --build "${FOLDER}/build")
must_succeed("Running the consumer" "${FOLDER}/build/consumer" "${FOLDER}/box.ply")

file(GLOB_RECURSE exported "${FOLDER}/prefix/*.cmake")
foreach(file IN LISTS exported)
  file(READ "${file}" text)
  string(FIND "${text}" "${SOURCE}/" place)
  if(NOT place EQUAL -1)
    message(FATAL_ERROR "${file} names the source tree ${SOURCE}: the package works on this machine only")
  endif()
endforeach()
file(REMOVE_RECURSE "${FOLDER}")
