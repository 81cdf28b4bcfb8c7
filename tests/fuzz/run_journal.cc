// What a run notes to bring back on a printer.
#include "session/run_journal.h"

#include "fuzz.h"
#include "memory_file.h"

TRAMMEL_FUZZ_TARGET(run_journal)(const std::uint8_t* data, std::size_t size) {
  using namespace trammel;
  static const fuzz::MemoryFile file("run.journal");
  file.Write(fuzz::Text(data, size));
  const auto journal = files::ReadJournal(file.path());
  if (!fuzz::Good(journal) || !*journal) return 0;
  fuzz::Require(files::IsRunName((*journal)->run), "a run has a name that can stand anywhere");
  fuzz::Require(fuzz::Good(files::WriteJournal(file.path(), **journal)), "it can be written");
  const auto again = files::ReadJournal(file.path());
  fuzz::Require(fuzz::Good(again) && *again, "a journal that was written can be read");
  fuzz::Require((*again)->before == (*journal)->before && (*again)->given == (*journal)->given,
                "a journal reads back as it was written");
  return 0;
}
