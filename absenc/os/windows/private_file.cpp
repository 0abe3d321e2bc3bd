// SPDX-License-Identifier: Apache-2.0
#include "absenc/os/private_file.hpp"

#include <windows.h>

#include <vector>

#include "absenc/os/windows/text.hpp"

namespace absenc::os {

namespace {

// Returns whether `user` is one that may read every file anyway.
bool is_administrator(PSID user) {
  return ::IsWellKnownSid(user, WinLocalSystemSid) != 0 || ::IsWellKnownSid(user, WinBuiltinAdministratorsSid) != 0;
}

// Returns whether the entry `number` of `list` lets users other than `owner` read or write the file.
bool lets_others(PACL list, DWORD number, PSID owner) {
  constexpr DWORD access = FILE_READ_DATA | FILE_WRITE_DATA | FILE_APPEND_DATA | GENERIC_READ | GENERIC_WRITE |
                           GENERIC_ALL | WRITE_DAC | WRITE_OWNER;
  void* entry = nullptr;
  if (::GetAce(list, number, &entry) == 0) return true;
  auto& allowed = *static_cast<ACCESS_ALLOWED_ACE*>(entry);
  if (allowed.Header.AceType != ACCESS_ALLOWED_ACE_TYPE || (allowed.Mask & access) == 0) return false;
  PSID user = &allowed.SidStart;
  return ::EqualSid(user, owner) == 0 && !is_administrator(user);
}

bool others_have_access(const std::string& path) {
  constexpr SECURITY_INFORMATION wanted = OWNER_SECURITY_INFORMATION | DACL_SECURITY_INFORMATION;
  const std::wstring name = utf16(path);
  DWORD size = 0;
  ::GetFileSecurityW(name.c_str(), wanted, nullptr, 0, &size);
  std::vector<char> descriptor(size);  // has the owner and the list
  if (::GetFileSecurityW(name.c_str(), wanted, descriptor.data(), size, &size) == 0) return false;
  PSID owner = nullptr;
  PACL list = nullptr;
  BOOL ignored = FALSE, has_list = FALSE;
  ::GetSecurityDescriptorOwner(descriptor.data(), &owner, &ignored);
  ::GetSecurityDescriptorDacl(descriptor.data(), &has_list, &list, &ignored);
  if (owner == nullptr || list == nullptr) return true;  // a file without a list is for everyone
  for (DWORD i = 0; i < list->AceCount; ++i) {
    if (lets_others(list, i, owner)) return true;
  }
  return false;
}

}  // namespace

std::string command_to_deny_others(const std::string& path) {
  if (!others_have_access(path)) return {};
  return "icacls \"" + path + "\" /inheritance:r /grant:r \"%USERNAME%:F\"";
}

}  // namespace absenc::os
