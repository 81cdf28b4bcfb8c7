# trammel_batch(TARGET): compiles a target's sources in batches, each one translation unit, where TRAMMEL_BATCH
# is on: headers are read, and templates instantiated, once a batch. A file is half a second of headers, so that
# a build from nothing takes half of the time; the presets fuzz and coverage compile each file by itself, which
# finds a missing #include.
#
# No two sources of a batch declare one name at file scope, nor does one declare what another brings in by
# "using": unnamed namespaces would meet in it. Such names are read from the sources when CMake runs; after a new one that clashes ("redefinition of ..."), run cmake again.
# tools/check_names.py holds that none has a constant by the name of a header's.
# A source of two targets is in a batch of the one whose call came last.
# A source with options of its own is compiled by itself, as is one whose names clash with those of a header
# that only another source reads: mark it with trammel_by_itself(FILE ...).
set(TRAMMEL_BATCH_SIZE 24)

function(trammel_by_itself)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# Sets NAMES to what the file SOURCE declares in its first column (constants, types, functions), and USED to what
# it brings in by "using a::Name".
function(trammel_declared_names source names used)
  file(READ ${source} text)
  string(REGEX REPLACE "[][;]" "=" text "${text}")
  string(REGEX MATCHALL "\n[a-zA-Z][a-zA-Z0-9_:<>,&* ]*[ &*][a-zA-Z_][a-zA-Z0-9_]*( *[{(=]| : )" lines "${text}")
  set(found)
  foreach(line IN LISTS lines)
    string(REGEX REPLACE " *[{(=:] ?$" "" line "${line}")
    string(REGEX REPLACE "^.*[ &*]" "" name "${line}")
    if(NOT line MATCHES "^\nnamespace")
      list(APPEND found ${name})
    endif()
  endforeach()
  list(REMOVE_DUPLICATES found)
  set(${names} "${found}" PARENT_SCOPE)
  string(REGEX MATCHALL "\nusing [a-zA-Z0-9_:]*::[a-zA-Z0-9_]+=" lines "${text}")
  string(REGEX REPLACE "\nusing [a-zA-Z0-9_:]*::|=" "" lines "${lines}")
  set(${used} "${lines}" PARENT_SCOPE)
endfunction()

# Sets FITS to whether BATCH has room for a source that declares NAMES and brings in USED: it is not full, and
# no name means two things there.
function(trammel_fits batch names used fits)
  set(${fits} FALSE PARENT_SCOPE)
  list(LENGTH sources_${batch} size)
  if(size GREATER_EQUAL TRAMMEL_BATCH_SIZE)
    return()
  endif()
  foreach(name IN LISTS names used)
    if(name IN_LIST declared_${batch})
      return()
    endif()
  endforeach()
  foreach(name IN LISTS names)
    if(name IN_LIST used_${batch})
      return()
    endif()
  endforeach()
  set(${fits} TRUE PARENT_SCOPE)
endfunction()

function(trammel_batch target)
  if(NOT TRAMMEL_BATCH)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    get_source_file_property(options ${source} COMPILE_OPTIONS)
    get_source_file_property(definitions ${source} COMPILE_DEFINITIONS)
    get_source_file_property(alone ${source} SKIP_UNITY_BUILD_INCLUSION)
    if(options OR definitions OR alone OR NOT source MATCHES "\\.cc$")
      continue()
    endif()
    get_filename_component(path ${source} ABSOLUTE)
    trammel_declared_names(${path} names used)
    set(batch 0)
    trammel_fits(${batch} "${names}" "${used}" fits)
    while(NOT fits)
      math(EXPR batch "${batch} + 1")
      trammel_fits(${batch} "${names}" "${used}" fits)
    endwhile()
    list(APPEND sources_${batch} ${source})
    list(APPEND declared_${batch} ${names})
    list(APPEND used_${batch} ${used})
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${target}_${batch})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()
