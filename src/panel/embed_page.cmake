# cmake -DPAGE=FOLDER -DOUT=FILE.cc -P embed_page.cmake: writes the page's files, compressed, as page_files.h declares them.
set(types index.html html panel.js javascript panel.css css)
set(arrays "")
set(rows "")
while(types)
  list(POP_FRONT types name type)
  execute_process(COMMAND gzip -9nc ${PAGE}/${name} OUTPUT_FILE ${PAGE}/${name}.gz COMMAND_ERROR_IS_FATAL ANY)
  file(SHA256 ${PAGE}/${name} hash)
  string(SUBSTRING ${hash} 0 16 hash)
  file(READ ${PAGE}/${name}.gz hex HEX)
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," bytes "${hex}")
  string(MAKE_C_IDENTIFIER k_${name} array)
  string(APPEND arrays "constexpr unsigned char ${array}[] = {${bytes}};\n")
  string(APPEND rows "    {\"/${name}\", \"text/${type}; charset=utf-8\", \"${hash}\", ${array}, sizeof(${array})},\n")
endwhile()
file(WRITE ${OUT} "#include \"panel/page_files.h\"\n\nnamespace trammel::panel {\nnamespace {\n\n${arrays}
constexpr PageFile kFiles[] = {\n${rows}};\n\n}  // namespace\n
std::span<const PageFile> PageFiles() { return kFiles; }\n\n}  // namespace trammel::panel\n")
