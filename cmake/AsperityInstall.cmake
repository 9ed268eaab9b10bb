# What cmake --install puts where: libraries, headers and the package that find_package(asperity) reads.

include(CMakePackageConfigHelpers)

set(package_folder "${CMAKE_INSTALL_LIBDIR}/cmake/asperity")

# Not the modules' own headers, nor those of the parts that are not installed as libraries.
install(DIRECTORY asperity DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h"
  PATTERN detail EXCLUDE PATTERN render/contact EXCLUDE PATTERN render/stages EXCLUDE
  PATTERN io/vdb EXCLUDE PATTERN io/vtk EXCLUDE PATTERN study/nlopt EXCLUDE)
install(EXPORT asperityTargets NAMESPACE asperity:: DESTINATION "${package_folder}")

configure_package_config_file(cmake/asperityConfig.cmake.in "${CMAKE_CURRENT_BINARY_DIR}/asperityConfig.cmake"
  INSTALL_DESTINATION "${package_folder}")
write_basic_package_version_file("${CMAKE_CURRENT_BINARY_DIR}/asperityConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/asperityConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/asperityConfigVersion.cmake"
  DESTINATION "${package_folder}")
