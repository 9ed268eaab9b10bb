# The plot library of the report pages: Dygraphs_SCRIPT and Dygraphs_STYLE, files to be embedded.

find_file(Dygraphs_SCRIPT dygraph.min.js PATHS /usr/share/javascript/dygraphs /usr/local/share/javascript/dygraphs)
find_file(Dygraphs_STYLE dygraph.min.css PATHS /usr/share/javascript/dygraphs /usr/local/share/javascript/dygraphs)
mark_as_advanced(Dygraphs_SCRIPT Dygraphs_STYLE)

if(Dygraphs_SCRIPT AND Dygraphs_STYLE)
  set(Dygraphs_FOUND TRUE)
else()
  set(Dygraphs_FOUND FALSE)
  if(Dygraphs_FIND_REQUIRED)
    message(FATAL_ERROR
      "dygraph.min.js and dygraph.min.css were not found: the report pages embed them. "
      "Install Debian's package libjs-dygraphs, or set Dygraphs_SCRIPT and Dygraphs_STYLE to the two files.")
  endif()
endif()
