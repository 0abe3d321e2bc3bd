// SPDX-License-Identifier: Apache-2.0
// A plugin for QEMU that counts the instructions between calls of count_begin and count_end, whose addresses are the
// arguments begin and end. Debian's QEMU lacks the header of plugins, so the functions in use are declared here.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <vector>

extern "C" {
using PluginId = std::uint64_t;
struct TranslationBlock;
struct Instruction;
using TranslateCallback = void (*)(PluginId, TranslationBlock*);
using ExecuteCallback = void (*)(unsigned cpu, void* data);
enum CallbackFlags { no_registers = 0 };

void qemu_plugin_register_vcpu_tb_trans_cb(PluginId, TranslateCallback);
std::size_t qemu_plugin_tb_n_insns(const TranslationBlock*);
Instruction* qemu_plugin_tb_get_insn(const TranslationBlock*, std::size_t index);
std::uint64_t qemu_plugin_insn_vaddr(const Instruction*);
void qemu_plugin_register_vcpu_insn_exec_cb(Instruction*, ExecuteCallback, CallbackFlags, void* data);

[[gnu::visibility("default")]] extern const int qemu_plugin_version;
const int qemu_plugin_version = 1;
}

namespace {

std::uint64_t begin_address = 0, end_address = 0, count = 0;
std::vector<std::uint64_t> begin_counts;  // instruction counts at each count_begin that has no count_end yet

void count_instruction(unsigned, void*) { ++count; }
void begin(unsigned, void*) { begin_counts.push_back(count); }
void end(unsigned, void*) {
  const unsigned long long counted = count - begin_counts.back();
  begin_counts.pop_back();
  std::printf("count %zu %llu\n", begin_counts.size(), counted);
  std::fflush(stdout);
}

void translated(PluginId, TranslationBlock* block) {
  for (std::size_t i = 0; i < qemu_plugin_tb_n_insns(block); ++i) {
    Instruction* const instruction = qemu_plugin_tb_get_insn(block, i);
    const std::uint64_t address = qemu_plugin_insn_vaddr(instruction);
    const ExecuteCallback what = address == begin_address ? begin : address == end_address ? end : count_instruction;
    qemu_plugin_register_vcpu_insn_exec_cb(instruction, what, no_registers, nullptr);
  }
}

}  // namespace

extern "C" [[gnu::visibility("default")]] int qemu_plugin_install(PluginId id, const void*, int count_of,
                                                                  char** texts) {
  for (int i = 0; i < count_of; ++i) {
    if (std::strncmp(texts[i], "begin=", 6) == 0) begin_address = std::strtoull(texts[i] + 6, nullptr, 0);
    if (std::strncmp(texts[i], "end=", 4) == 0) end_address = std::strtoull(texts[i] + 4, nullptr, 0);
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
  return 0;
}
