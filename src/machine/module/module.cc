#include "machine/module/module.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <map>
#include <mutex>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace trammel::machine {
namespace {

namespace fs = std::filesystem;

template <class Function>
Function* FunctionOf(void* module, const char* name) {
  return reinterpret_cast<Function*>(dlsym(module, name));
}

tl::unexpected<Error> NotThere(const ModuleName& name, std::span<const fs::path> folders) {
  std::string looked;
  for (const fs::path& folder : folders) {
    looked += fmt::format("{}{}", looked.empty() ? "" : " and ", folder.string());
  }
  return Fail(
      fmt::format("{} needs the module {}.so, which this trammel came without (looked for in "
                  "{}); install the package {}, or build trammel with that module",
                  name.purpose, name.file, looked, name.package));
}

/// Owning file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) close(fd_);
  }
  [[nodiscard]] int get() const { return fd_; }
  [[nodiscard]] int Release() { return std::exchange(fd_, -1); }
  void Replace(int fd) {
    if (fd_ >= 0) close(fd_);
    fd_ = fd;
  }

 private:
  int fd_;
};

/// Users who could have written the program itself, or who accept what these run.
class Trust {
 public:
  Trust() {
    struct stat program {};
    if (stat("/proc/self/exe", &program) != 0) return;
    owner_ = program.st_uid;
    AddGroup(program);
    std::error_code error;
    const fs::path path = fs::read_symlink("/proc/self/exe", error);
    struct stat folder {};
    if (!error && stat(path.parent_path().c_str(), &folder) == 0) AddGroup(folder);
  }

  /// True if no untrusted user can write a file, or change trusted entries of a folder. In a sticky
  /// folder, such as /tmp, only an entry's owner can.
  [[nodiscard]] bool Alone(const struct stat& found) const {
    const bool owned = found.st_uid == 0 || found.st_uid == owner_ || found.st_uid == geteuid();
    const bool sticky = S_ISDIR(found.st_mode) && (found.st_mode & S_ISVTX) != 0;
    const bool by_all = (found.st_mode & S_IWOTH) != 0;
    const bool by_group = (found.st_mode & S_IWGRP) != 0 && found.st_gid != 0 &&
                          std::ranges::find(groups_, found.st_gid) == groups_.end();
    return owned && (sticky || (!by_all && !by_group));
  }

 private:
  void AddGroup(const struct stat& found) {
    if ((found.st_mode & S_IWGRP) != 0) groups_.push_back(found.st_gid);
  }

  uid_t owner_ = 0;
  std::vector<gid_t> groups_;
};

/// Opens a file that only the program's owner and root can have written, starting from the root of
/// the file system: each folder and the file are checked after opening, and no link is followed.
/// @param path  absolute, without links. Errors name the folder or file.
Result<int> OpenTrusted(const fs::path& path) {
  const Trust trust;
  Descriptor at(open("/", O_PATH | O_DIRECTORY | O_CLOEXEC));
  fs::path so_far = "/";
  for (auto part = std::next(path.begin()); at.get() >= 0; ++part) {
    struct stat found {};
    if (fstat(at.get(), &found) != 0) break;
    if (!trust.Alone(found)) {
      return Fail(fmt::format("{} is not the program's owner's, or others may write to it",
                              so_far.string()));
    }
    if (part == path.end()) return at.Release();
    const bool is_file = std::next(part) == path.end();
    so_far /= *part;
    at.Replace(
        openat(at.get(), part->c_str(),
               O_NOFOLLOW | O_CLOEXEC | (is_file ? O_RDONLY | O_NONBLOCK : O_PATH | O_DIRECTORY)));
  }
  return Fail(fmt::format("{} cannot be opened: {}", so_far.string(), std::strerror(errno)));
}

/// Returns the table of an open module. @param path  of it, for messages
Result<const void*> TableOf(int module_fd, const ModuleName& name, const fs::path& path) {
  void* const module = dlopen(fmt::format("/proc/self/fd/{}", module_fd).c_str(),
                              RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
  if (module == nullptr) {
    const char* reason = dlerror();
    return Fail(
        fmt::format("{} needs libraries that cannot be loaded ({}: {}); install them: apt "
                    "install {}",
                    name.purpose, path.string(), reason != nullptr ? reason : "no reason given",
                    name.packages));
  }
  auto* const version = FunctionOf<const char*()>(module, "trammel_module_version");
  auto* const table = FunctionOf<const void*()>(module, "trammel_module");
  if (version == nullptr || table == nullptr || std::string_view(version()) != TRAMMEL_VERSION) {
    return Fail(
        fmt::format("{}: {} is of another version than this trammel ({}); install both anew",
                    name.purpose, path.string(), TRAMMEL_VERSION));
  }
  return table();
}

/// Caches loaded modules by path. Their descriptors remain open: the loader identifies a module by
/// its descriptor's name, which another file must not get.
Result<const void*> LoadOnce(const ModuleName& name, const fs::path& path) {
  static std::mutex mutex;
  static std::map<std::string, Result<const void*>> loaded;
  const std::lock_guard lock(mutex);
  const auto before = loaded.find(path.string());
  if (before != loaded.end()) return before->second;
  const auto file = OpenTrusted(path);
  if (!file) {
    return Fail(fmt::format("{}: {}; install trammel anew", name.purpose, file.error().message));
  }
  return loaded.emplace(path.string(), TableOf(*file, name, path)).first->second;
}

}  // namespace

const ModuleName kAravisModule = {"trammel-aravis", "a GigE Vision or USB3 Vision camera",
                                  "trammel-machine-vision", "libaravis-0.8-0"};
const ModuleName kPdfModule = {"trammel-pdf", "reading a PDF", "trammel", "libqpdf"};
const ModuleName kWebpModule = {"trammel-webp", "reading a WebP photo", "trammel-photos",
                                "libwebp7"};
const ModuleName kHeifModule = {"trammel-heif", "reading a HEIC photo", "trammel-photos",
                                "libheif1"};
const ModuleName kStepModule = {"trammel-step", "reading STEP", "trammel-step",
                                TRAMMEL_STEP_PACKAGES};

std::vector<fs::path> ModuleFolders() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  if (error) return {};
  const fs::path folder = program.parent_path().parent_path();
  std::vector<fs::path> folders = {folder / "lib/trammel"};
  // Programs of a build tree are one folder deeper. Elsewhere this would be another program's.
  if (fs::exists(folder.parent_path() / "CMakeCache.txt", error)) {
    folders.push_back(folder.parent_path() / "lib/trammel");
  }
  return folders;
}

Result<const void*> LoadModule(const ModuleName& name, std::span<const fs::path> folders) {
  for (const fs::path& folder : folders) {
    const fs::path path = folder / fmt::format("{}.so", name.file);
    std::error_code error;
    const fs::path real = fs::canonical(path, error);
    if (!error) return LoadOnce(name, real);
  }
  return NotThere(name, folders);
}

}  // namespace trammel::machine
