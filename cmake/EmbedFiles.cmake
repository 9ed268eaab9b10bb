# Text files as strings in the library, so that the installed program needs no files beside it.
#
# Included: asperity_embed_files(TARGET SYMBOL files...) gives TARGET the function
#   std::span<const asperity::EmbeddedFile> asperity::SYMBOL()      (asperity/io/embedded_file.h)
# with the files in the order given. Run as a script (cmake -P), it writes the source file; that is what the build does.

if(CMAKE_SCRIPT_MODE_FILE)
  set(entries "")
  foreach(file IN LISTS FILES)
    get_filename_component(name "${file}" NAME)
    file(READ "${file}" text)
    string(APPEND entries "    {\"${name}\", R\"embedded_file(${text})embedded_file\"},\n")
  endforeach()
  file(WRITE "${OUTPUT}" "// Made from the files it holds; see cmake/EmbedFiles.cmake.
#include \"asperity/io/embedded_file.h\"

namespace asperity {

std::span<const EmbeddedFile> ${SYMBOL}() {
  static constexpr EmbeddedFile files[] = {
${entries}  };
  return files;
}

}  // namespace asperity
")
  return()
endif()

set(ASPERITY_EMBED_SCRIPT "${CMAKE_CURRENT_LIST_FILE}")

function(asperity_embed_files target symbol)
  set(files ${ARGN})
  list(TRANSFORM files PREPEND "${PROJECT_SOURCE_DIR}/")
  set(output "${CMAKE_CURRENT_BINARY_DIR}/${symbol}.cpp")
  string(REPLACE ";" "$<SEMICOLON>" joined "${files}")
  add_custom_command(OUTPUT "${output}"
    COMMAND "${CMAKE_COMMAND}" "-DOUTPUT=${output}" "-DSYMBOL=${symbol}" "-DFILES=${joined}" -P "${ASPERITY_EMBED_SCRIPT}"
    DEPENDS ${files} "${ASPERITY_EMBED_SCRIPT}" VERBATIM COMMENT "Embedding ${symbol}")
  set_source_files_properties("${output}" PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
  target_sources(${target} PRIVATE "${output}")
endfunction()
