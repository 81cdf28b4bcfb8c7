// Places of pictures of a board, touches, and the layout of its sheet.
#include "part_alignment/files/board_file.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(board_file)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("file.json");
  file.Write(fuzz::Text(data, size));
  (void)fuzz::Good(files::ReadBoardFile(file.path()));
  return 0;
}
