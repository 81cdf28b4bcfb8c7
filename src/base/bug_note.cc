#include "base/bug_note.h"

#include <exception>
#include <mutex>

namespace trammel {
namespace {

std::mutex mutex;
std::optional<std::string> first;  // guarded by mutex

std::string Note(std::string what) {
  const std::lock_guard lock(mutex);
  if (!first) first = what;
  return what;
}

}  // namespace

std::optional<std::string> NoteBug(const std::function<void()>& work) {
  try {
    work();
    return std::nullopt;
  } catch (const std::exception& thrown) {
    return Note(thrown.what());
  } catch (...) {
    return Note("something was thrown that is no std::exception");
  }
}

std::optional<std::string> NotedBug() {
  const std::lock_guard lock(mutex);
  return first;
}

}  // namespace trammel
