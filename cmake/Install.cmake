# cmake --install: the programs with their modules, libtrammel_tap with its header and what CMake and pkg-config ask for, what
# goes onto the printer, and the manual.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

install(TARGETS trammel trammel-sim)
# The program looks for them in lib/trammel beside its own folder, whatever CMAKE_INSTALL_LIBDIR is.
foreach(module aravis webp heif pdf step)
  if(TARGET trammel_${module}_module)
    install(TARGETS trammel_${module}_module LIBRARY DESTINATION lib/trammel)
  endif()
endforeach()

if(TRAMMEL_TAP)
  install(TARGETS trammel_tap_shared EXPORT trammel)
  install(FILES ${PROJECT_SOURCE_DIR}/include/trammel/tap.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/trammel)
  set(trammel_cmake ${CMAKE_INSTALL_LIBDIR}/cmake/trammel)
  set_target_properties(trammel_tap_shared PROPERTIES EXPORT_NAME tap)
  install(EXPORT trammel NAMESPACE trammel:: DESTINATION ${trammel_cmake} FILE trammelConfig.cmake)
  write_basic_package_version_file(${PROJECT_BINARY_DIR}/trammelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
  install(FILES ${PROJECT_BINARY_DIR}/trammelConfigVersion.cmake DESTINATION ${trammel_cmake})
  # ${pcfiledir} in place of CMAKE_INSTALL_PREFIX: cmake --install --prefix may name another folder, and a tree may be moved.
  file(RELATIVE_PATH trammel_prefix /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
  configure_file(cmake/trammel-tap.pc.in trammel-tap.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/trammel-tap.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endif()

install(DIRECTORY ${PROJECT_SOURCE_DIR}/klipper ${PROJECT_SOURCE_DIR}/examples DESTINATION ${CMAKE_INSTALL_DATADIR}/trammel
        PATTERN __pycache__ EXCLUDE)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/ DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES README.md CHANGELOG.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})

# The manual pages and the completions, made by the programs themselves.
foreach(program trammel trammel-sim)
  set(texts ${PROJECT_BINARY_DIR}/texts/${program})
  foreach(text "manual" "completion bash" "completion zsh")
    separate_arguments(words UNIX_COMMAND ${text})
    string(REPLACE " " "_" name ${text})
    add_custom_command(OUTPUT ${texts}/${name} DEPENDS ${program} VERBATIM
                       COMMAND sh -c "mkdir -p ${texts} && \"$@\" > ${texts}/${name}" ${program}
                               ${CMAKE_CROSSCOMPILING_EMULATOR} $<TARGET_FILE:${program}> ${words})
    list(APPEND trammel_texts ${texts}/${name})
  endforeach()
  install(FILES ${texts}/manual DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME ${program}.1)
  install(FILES ${texts}/completion_bash RENAME ${program}
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES ${texts}/completion_zsh RENAME _${program}
          DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
endforeach()
add_custom_target(trammel_texts ALL DEPENDS ${trammel_texts})
