// A driver for SANE that fails in the way that the name of its device says: what real ones do.
// Loaded by SANE's own loader from LD_LIBRARY_PATH, with "faulty" in dll.conf.
#include <sane/sane.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <string>

namespace {

constexpr SANE_Int kWidth = 100;
constexpr SANE_Int kLines = 50;

std::string fault;
SANE_Int bytes_left = 0;

[[noreturn]] void Hang() {
  for (;;) pause();
}

SANE_Option_Descriptor Number(const char* name) {
  SANE_Option_Descriptor option{};
  option.name = option.title = option.desc = name;
  option.type = SANE_TYPE_INT;
  option.size = sizeof(SANE_Word);
  option.cap = SANE_CAP_SOFT_SELECT | SANE_CAP_SOFT_DETECT;
  return option;
}

}  // namespace

extern "C" {

SANE_Status sane_faulty_init(SANE_Int* version, SANE_Auth_Callback) {
  if (version != nullptr) *version = SANE_VERSION_CODE(1, 0, 0);
  return SANE_STATUS_GOOD;
}

void sane_faulty_exit() {}

SANE_Status sane_faulty_get_devices(const SANE_Device*** devices, SANE_Bool) {
  static const SANE_Device* none[] = {nullptr};
  *devices = none;
  return SANE_STATUS_GOOD;
}

SANE_Status sane_faulty_open(SANE_String_Const name, SANE_Handle* handle) {
  fault = name;
  if (fault == "hangs-when-opened") Hang();
  if (fault == "crashes-when-opened") raise(SIGSEGV);
  if (fault == "leaves-when-opened") _exit(0);
  *handle = &fault;
  return SANE_STATUS_GOOD;
}

void sane_faulty_close(SANE_Handle) {
  if (fault == "hangs-when-closed") Hang();
  if (fault == "crashes-when-closed") raise(SIGSEGV);
}

const SANE_Option_Descriptor* sane_faulty_get_option_descriptor(SANE_Handle, SANE_Int option) {
  static const SANE_Option_Descriptor kOptions[] = {Number(""), Number("resolution")};
  return option >= 0 && option < 2 ? &kOptions[option] : nullptr;
}

SANE_Status sane_faulty_control_option(SANE_Handle, SANE_Int option, SANE_Action action,
                                       void* value, SANE_Int* info) {
  if (info != nullptr) *info = 0;
  if (option == 0 && action == SANE_ACTION_GET_VALUE) *static_cast<SANE_Word*>(value) = 2;
  if (option == 1 && action == SANE_ACTION_GET_VALUE) *static_cast<SANE_Word*>(value) = 600;
  return SANE_STATUS_GOOD;
}

SANE_Status sane_faulty_get_parameters(SANE_Handle, SANE_Parameters* parameters) {
  *parameters = {SANE_FRAME_GRAY, SANE_TRUE, kWidth, kWidth, kLines, 8};
  if (fault == "has-narrow-lines") parameters->bytes_per_line = kWidth - 1;
  if (fault == "has-no-width") parameters->pixels_per_line = -1;
  if (fault == "has-odd-bits") parameters->depth = 12;
  if (fault == "is-endless") parameters->lines = -1;
  if (fault == "repeats-red") parameters->format = SANE_FRAME_RED;
  if (fault == "repeats-red") parameters->last_frame = SANE_FALSE;
  return SANE_STATUS_GOOD;
}

SANE_Status sane_faulty_start(SANE_Handle) {
  bytes_left = kWidth * (fault == "ends-early" ? kLines / 2 : kLines);
  return SANE_STATUS_GOOD;
}

SANE_Status sane_faulty_read(SANE_Handle, SANE_Byte* data, SANE_Int most, SANE_Int* count) {
  *count = 0;
  if (fault == "hangs") Hang();
  if (fault == "crashes" && bytes_left < kWidth * kLines) raise(SIGSEGV);
  if (bytes_left == 0) return SANE_STATUS_EOF;
  // Lines are torn apart, as by a scanner's own buffers.
  constexpr SANE_Int kPiece = 333;
  *count = std::min({most, fault == "is-endless" ? most : bytes_left, kPiece});
  std::memset(data, 200, static_cast<std::size_t>(*count));
  if (fault != "is-endless") bytes_left -= *count;
  return SANE_STATUS_GOOD;
}

void sane_faulty_cancel(SANE_Handle) {}

SANE_Status sane_faulty_set_io_mode(SANE_Handle, SANE_Bool) { return SANE_STATUS_GOOD; }

SANE_Status sane_faulty_get_select_fd(SANE_Handle, SANE_Int*) { return SANE_STATUS_UNSUPPORTED; }

}  // extern "C"
