/* host.c: the requests of a machine on this computer: packets from standard input, answers to
 * standard output.
 *
 * A packet: bytes of the saved state (4), its time (4), bytes of the requests (4), all of these.
 * An answer: 0 or why the state could not be restored (4); the machine; then parts until all requests
 * are answered: bytes of the requests answered so far (4), bytes of the answers (4), bytes of the saved
 * machines (4), all of these. */
#define _XOPEN_SOURCE 600 /* setrlimit */

#include "driver.h"

#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>

enum { CERTIFY_SAVED = 0x400000 };

uint8_t certify_saved[CERTIFY_SAVED];
uint32_t certify_saved_size;
uint32_t certify_restore(uint32_t now, const uint8_t *bytes, uint32_t size);

static void read_all(void *to, size_t size)
{
    if (fread(to, 1, size, stdin) != size) {
        exit(feof(stdin) && !ferror(stdin) ? 0 : 2);
    }
}

static uint32_t read32(void)
{
    uint8_t b[4];
    read_all(b, sizeof b);
    return b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24;
}

static void write_all(const void *from, size_t size)
{
    if (fwrite(from, 1, size, stdout) != size) {
        exit(2);
    }
}

static void write32(uint32_t value)
{
    const uint8_t b[4] = {(uint8_t)value, (uint8_t)(value >> 8), (uint8_t)(value >> 16), (uint8_t)(value >> 24)};
    write_all(b, sizeof b);
}

int main(int count, char **words)
{
    static uint8_t saved[CERTIFY_SAVED];
    const long seconds = count > 1 ? strtol(words[1], NULL, 10) : 0;
    if (seconds > 0) {
        const struct rlimit most = {(rlim_t)seconds, (rlim_t)seconds};
        (void)setrlimit(RLIMIT_CPU, &most); /* a machine that does not return ends the program */
    }
    for (;;) {
        const uint32_t size = read32(), now = read32();
        certify_request_size = read32();
        if (size > sizeof saved || certify_request_size > CERTIFY_REQUEST_BYTES) {
            return 2;
        }
        read_all(saved, size);
        read_all(certify_requests, certify_request_size);
        write32(certify_restore(now, saved, size));
        write_all(certify_state(), certify_machine_size);
        certify_answered = 0;
        do {
            certify_saved_size = 0;
            certify_main();
            write32(certify_answered);
            write32(certify_answer_size);
            write32(certify_saved_size);
            write_all(certify_answers, certify_answer_size);
            write_all(certify_saved, certify_saved_size);
        } while (certify_answered < certify_request_size);
        fflush(stdout);
    }
}
