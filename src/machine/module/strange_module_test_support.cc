// A shared module that is none of trammel's.
extern "C" const char* trammel_module_version() { return "another"; }
extern "C" const void* trammel_module() { return nullptr; }
