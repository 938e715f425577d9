/* The terminal of the slcan back end: its name and link, clients that come and go. The protocol is
 * tested in tests/port, the seam by the conformance suite. */
#include <errno.h>
#include <fcntl.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <cmocka.h>

#include "kl_slcan_pty.h"

static struct kl_slcan_pty pty;
static struct kl_can can;
static char folder[] = "/tmp/klingel_slcan_XXXXXX";
static char path[64];

static int make_folder(void **state) {
    (void)state;
    if (mkdtemp(folder) == NULL)
        return -1;
    (void)snprintf(path, sizeof path, "%s/bus", folder);
    return 0;
}

static int remove_folder(void **state) {
    (void)state;
    return rmdir(folder); /* fails if something was left behind */
}

static void open_or_fail(const char *at) {
    assert_int_equal(kl_slcan_pty_open(&pty, at), KL_CAN_OK);
    can = kl_slcan_pty_can(&pty);
}

static int join(const char *name) {
    int client = open(name, O_RDWR | O_NOCTTY | O_NONBLOCK);
    assert_true(client >= 0);
    return client;
}

/* What the client reads, CR as '.', after the back end was serviced. */
static const char *talk(int client, const char *line) {
    static char text[256];
    size_t n = 0;
    assert_int_equal(write(client, line, strlen(line)), strlen(line));
    for (int i = 0; i < 50; i++) {
        kl_can_service(&can);
        ssize_t size = read(client, text + n, sizeof text - 1 - n);
        n += size > 0 ? (size_t)size : 0;
        usleep(200);
    }
    text[n] = '\0';
    for (char *at = text; *at != '\0'; at++)
        *at = (char)(*at == '\r' ? '.' : *at);
    return text;
}

static void bytes_pass_as_they_are(void **state) {
    (void)state;
    struct termios settings;
    struct kl_can_frame frame;
    open_or_fail(path);
    int client = join(path); /* by the link */
    assert_int_equal(tcgetattr(client, &settings), 0);
    assert_int_equal(settings.c_lflag & (ECHO | ICANON | ISIG), 0);
    assert_int_equal(settings.c_iflag & (ICRNL | IXON | INLCR), 0);
    assert_int_equal(settings.c_oflag & OPOST, 0);
    assert_string_equal(talk(client, "S6\rO\rt1232AABB\r"), "..z.");
    assert_int_equal(kl_can_receive(&can, &frame), KL_CAN_OK);
    assert_int_equal(frame.id, 0x123);
    assert_int_equal(frame.data[1], 0xBB);
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    assert_string_equal(talk(client, ""), "t1232AABB.");
    (void)close(client);
    kl_can_close(&can);
    assert_string_equal(kl_slcan_pty_name(&pty), "");
}

static void the_next_client_finds_nothing_of_the_last(void **state) {
    (void)state;
    const struct kl_can_frame frame = {.id = 0x123, .length = 8};
    open_or_fail(NULL);
    int client = join(kl_slcan_pty_name(&pty));
    assert_string_equal(talk(client, "O\r"), ".");
    for (int i = 0; i < 1000; i++) { /* more than the kernel holds: some lies in every place */
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
        kl_can_service(&can);
    }
    assert_int_equal(write(client, "t12", 3), 3);
    (void)close(client);
    kl_can_service(&can);
    kl_can_service(&can);
    assert_int_equal(kl_slcan_link_channel(&pty.link), KL_SLCAN_CLOSED);
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK); /* nowhere */
    client = join(kl_slcan_pty_name(&pty));
    assert_string_equal(talk(client, ""), "");
    assert_string_equal(talk(client, "V\rO\r"), "V0101..");
    (void)close(client);
    kl_can_close(&can);
}

static void links_replace_links_and_nothing_else(void **state) {
    (void)state;
    struct stat there;
    assert_int_equal(symlink("/nowhere", path), 0);
    open_or_fail(path);
    kl_can_close(&can);
    assert_int_equal(lstat(path, &there), -1);

    int file = open(path, O_CREAT | O_WRONLY, 0600);
    (void)close(file);
    assert_int_equal(kl_slcan_pty_open(&pty, path), KL_CAN_FAILED);
    assert_non_null(strstr(kl_slcan_pty_text(&pty), "File exists"));
    assert_int_equal(unlink(path), 0);
    assert_int_equal(kl_slcan_pty_open(&pty, "/nowhere/at/all"), KL_CAN_FAILED);

    open_or_fail(path); /* somebody else's by now: left alone */
    assert_int_equal(unlink(path), 0);
    assert_int_equal(symlink("/nowhere", path), 0);
    kl_can_close(&can);
    assert_int_equal(lstat(path, &there), 0);
    assert_int_equal(unlink(path), 0);
}

static void wrong_arguments_are_refused(void **state) {
    (void)state;
    char longest[KL_SLCAN_PTY_PATH_BYTES + 1];
    memset(longest, 'x', sizeof longest);
    longest[sizeof longest - 1] = '\0';
    assert_int_equal(kl_slcan_pty_open(NULL, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_slcan_pty_open(&pty, longest), KL_CAN_ARGUMENT);
    assert_string_equal(kl_slcan_pty_name(NULL), "");
    assert_string_equal(kl_slcan_pty_text(NULL), "");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_pass_as_they_are),
        cmocka_unit_test(the_next_client_finds_nothing_of_the_last),
        cmocka_unit_test(links_replace_links_and_nothing_else),
        cmocka_unit_test(wrong_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
