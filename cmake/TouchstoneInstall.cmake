# Installs the libraries, their headers and a package file, so that find_package(Touchstone) gives
# Touchstone::core, Touchstone::sensors and so on: those parts that this build has.
include(CMakePackageConfigHelpers)
get_property(libraries GLOBAL PROPERTY TOUCHSTONE_LIBRARIES)
install(TARGETS ${libraries} EXPORT TouchstoneTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
foreach(part IN LISTS TOUCHSTONE_PARTS)
  if(NOT part MATCHES "^(apps|python)$")
    install(DIRECTORY ${part} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/touchstone FILES_MATCHING PATTERN "*.h")
  endif()
endforeach()
if(TARGET touchstone_testing)
  install(DIRECTORY testing/touchstone DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")
  set(TOUCHSTONE_TESTING ON)
endif()
if("sim" IN_LIST TOUCHSTONE_PARTS)
  install(DIRECTORY scenes DESTINATION ${CMAKE_INSTALL_DATADIR}/touchstone)
endif()
install(EXPORT TouchstoneTargets NAMESPACE Touchstone:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Touchstone)
configure_package_config_file(cmake/TouchstoneConfig.cmake.in TouchstoneConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Touchstone)
write_basic_package_version_file(TouchstoneConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/TouchstoneConfig.cmake" "${PROJECT_BINARY_DIR}/TouchstoneConfigVersion.cmake"
  cmake/Dependencies.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Touchstone)
