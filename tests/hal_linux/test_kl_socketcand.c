/* The socketcand server as its clients see it: handshake, several clients, bad ones, slow ones. */
#include "kl_socketcand.h"

#include "hal_linux/tcp_peer.h"

#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>

#include <cmocka.h>

static struct kl_socketcand server;
static struct kl_can can;

static int start(void **state) {
    (void)state;
    const struct kl_socketcand_options options = {.port = 0, .send_buffer_bytes = 4096};
    if (kl_socketcand_open(&server, &options) != KL_CAN_OK)
        return -1;
    can = kl_socketcand_can(&server);
    return 0;
}

static int stop(void **state) {
    (void)state;
    kl_can_close(&can);
    return 0;
}

static uint16_t port(void) {
    return kl_socketcand_port(&server);
}

static struct kl_socketcand_stats stats(void) {
    struct kl_socketcand_stats now;
    kl_socketcand_get_stats(&server, &now);
    return now;
}

static struct kl_can_counts counts(void) {
    struct kl_can_counts now;
    kl_can_get_counts(&can, &now);
    return now;
}

static void serve(int milliseconds) {
    for (int i = 0; i < milliseconds; i++) {
        kl_can_service(&can);
        test_sleep_us(1000);
    }
}

static bool say(struct tcp_peer *peer, const char *text) {
    return tcp_peer_say(peer, text, strlen(text));
}

static bool hears(struct tcp_peer *peer, struct kl_can_frame *frame) {
    for (int i = 0; i < 200; i++) {
        kl_can_service(&can);
        tcp_peer_read(peer);
        if (tcp_peer_take(peer, frame))
            return true;
        test_sleep_us(500);
    }
    return false;
}

/* ---- opening ---- */

static void port_in_use_is_told(void **state) {
    (void)state;
    static struct kl_socketcand second;
    const struct kl_socketcand_options options = {.port = port()};
    assert_int_equal(kl_socketcand_open(&second, &options), KL_CAN_FAILED);
    assert_non_null(strstr(kl_socketcand_text(&second), "Address already in use"));
    const struct kl_can other = kl_socketcand_can(&second);
    assert_false(kl_can_is_up(&other));
    kl_can_close(&other);
    assert_true(kl_can_is_up(&can));
}

static void the_port_is_free_again_at_once(void **state) {
    (void)state;
    struct tcp_peer peer;
    const struct kl_socketcand_options options = {.port = port()};
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    kl_can_close(&can); /* the server closes first: its end of the connection lingers */
    assert_int_equal(kl_socketcand_open(&server, &options), KL_CAN_OK);
    tcp_peer_close(&peer);
}

static void arguments_are_checked(void **state) {
    (void)state;
    static struct kl_socketcand other;
    const struct kl_socketcand_options options = {
        .channel = "a name that is much longer than a channel has"};
    assert_int_equal(kl_socketcand_open(NULL, NULL), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcand_open(&other, &options), KL_CAN_ARGUMENT);
    assert_int_equal(kl_socketcand_port(&other), 0);
    assert_int_equal(kl_socketcand_port(NULL), 0);
    assert_string_equal(kl_socketcand_text(NULL), "");
}

/* ---- handshake ---- */

static void streaming_waits_for_the_quiet_time(void **state) {
    (void)state;
    struct tcp_peer peer;
    const struct kl_can_frame frame = {.id = 0x111, .length = 1, .data = {7}};
    assert_true(tcp_peer_connect(&peer, port(), 0));
    assert_true(tcp_peer_expect(&peer, &can, "< hi >"));
    assert_true(say(&peer, "< open vcan0 >"));
    assert_true(tcp_peer_expect(&peer, &can, "< ok >"));
    assert_true(say(&peer, "< rawmode >"));
    int64_t ok_ns = 0;
    int64_t first_ns = 0;
    for (int i = 0; i < 2000 && first_ns == 0; i++) {
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
        kl_can_service(&can);
        bool news = tcp_peer_read(&peer) > 0;
        if (news && ok_ns == 0) {
            assert_string_equal(peer.text, "< ok >"); /* alone */
            ok_ns = test_now_ns();
            tcp_peer_eat(&peer, peer.length);
        } else if (news) {
            first_ns = test_now_ns();
            assert_memory_equal(peer.text, "\n< frame 111 ", 13);
        }
        test_sleep_us(200);
    }
    assert_true(ok_ns > 0);
    /* The reply may have been read a little after it was sent. */
    assert_true(first_ns - ok_ns >= (KL_SOCKETCAND_QUIET_MS - 2) * INT64_C(1000000));
    assert_int_equal(counts().send_dropped, 0);
    tcp_peer_close(&peer);
}

static void handshake_in_single_bytes(void **state) {
    (void)state;
    struct tcp_peer peer;
    assert_true(tcp_peer_connect(&peer, port(), 0));
    assert_true(tcp_peer_expect(&peer, &can, "< hi >"));
    for (const char *c = "\r\n< open  any  >\n"; *c != '\0'; c++) {
        assert_true(tcp_peer_say(&peer, c, 1));
        serve(1);
    }
    assert_true(tcp_peer_expect(&peer, &can, "< ok >"));
    tcp_peer_close(&peer);
}

static void wrong_order_gets_an_error(void **state) {
    (void)state;
    struct tcp_peer peer;
    struct kl_can_frame frame;
    assert_true(tcp_peer_connect(&peer, port(), 0));
    assert_true(tcp_peer_expect(&peer, &can, "< hi >"));
    assert_true(say(&peer, "< rawmode >"));
    assert_true(tcp_peer_expect(&peer, &can, "< error unknown command >"));
    assert_true(say(&peer, "< send 123 0 >"));
    assert_true(tcp_peer_expect(&peer, &can, "< error unknown command >"));
    assert_true(say(&peer, "< echo >"));
    assert_true(tcp_peer_expect(&peer, &can, "< echo >"));
    assert_true(say(&peer, "< open >"));
    assert_true(tcp_peer_expect(&peer, &can, "< error could not open bus >"));
    assert_int_equal(kl_can_receive(&can, &frame), KL_CAN_EMPTY);
    assert_int_equal(counts().refused, 3);
    tcp_peer_close(&peer);
}

static void only_the_channel_there_is(void **state) {
    (void)state;
    struct tcp_peer peer;
    const struct kl_socketcand_options options = {.channel = "bogie0"};
    kl_can_close(&can);
    assert_int_equal(kl_socketcand_open(&server, &options), KL_CAN_OK);
    assert_true(tcp_peer_connect(&peer, port(), 0));
    assert_true(tcp_peer_expect(&peer, &can, "< hi >"));
    assert_true(say(&peer, "< open bogie >"));
    assert_true(tcp_peer_expect(&peer, &can, "< error could not open bus >"));
    assert_true(say(&peer, "< open bogie0 >"));
    assert_true(tcp_peer_expect(&peer, &can, "< ok >"));
    tcp_peer_close(&peer);
}

/* ---- the bus ---- */

static void without_clients_frames_go_nowhere(void **state) {
    (void)state;
    const struct kl_can_frame frame = {.id = 1};
    for (int i = 0; i < 100000; i++)
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    assert_true(kl_can_is_up(&can));
    assert_int_equal(counts().sent, 100000);
    assert_int_equal(counts().send_dropped, 0);
}

static void clients_hear_the_owner_and_each_other(void **state) {
    (void)state;
    struct tcp_peer peers[3];
    struct kl_can_frame frame = {.id = 0x123, .length = 2, .data = {1, 2}};
    struct kl_can_frame got;
    for (int i = 0; i < 3; i++)
        assert_true(tcp_peer_join(&peers[i], &can, port(), 0));
    assert_int_equal(stats().streaming, 3);
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    for (int i = 0; i < 3; i++) {
        assert_true(hears(&peers[i], &got));
        assert_int_equal(got.id, 0x123);
    }
    frame.id = 0x456;
    assert_true(tcp_peer_send(&peers[1], &frame));
    assert_true(hears(&peers[0], &got) && got.id == 0x456);
    assert_true(hears(&peers[2], &got) && got.id == 0x456);
    assert_false(hears(&peers[1], &got));
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_OK);
    assert_int_equal(got.id, 0x456);
    assert_int_equal(counts().sent, 1);
    for (int i = 0; i < 3; i++)
        tcp_peer_close(&peers[i]);
    serve(5);
    assert_int_equal(stats().clients, 0);
    assert_int_equal(stats().streaming, 0);
}

static void slow_client_loses_and_the_others_do_not(void **state) {
    (void)state;
    enum { FRAMES = 20000 };
    struct tcp_peer slow;
    struct tcp_peer quick;
    struct kl_can_frame got;
    unsigned heard = 0;
    int64_t longest_ns = 0;
    assert_true(tcp_peer_join(&slow, &can, port(), 4096));
    assert_true(tcp_peer_join(&quick, &can, port(), 0));
    for (unsigned i = 0; i < FRAMES; i++) {
        struct kl_can_frame frame = {
            .id = 0x100, .length = 4, .data = {(uint8_t)i, (uint8_t)(i >> 8)}};
        int64_t began_ns = test_now_ns();
        assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
        kl_can_service(&can);
        int64_t took_ns = test_now_ns() - began_ns;
        longest_ns = took_ns > longest_ns ? took_ns : longest_ns;
        tcp_peer_read(&quick);
        for (; tcp_peer_take(&quick, &got); heard++)
            assert_int_equal(got.data[0] | got.data[1] << 8, heard & 0xFFFF);
    }
    for (; hears(&quick, &got); heard++)
        assert_int_equal(got.data[0] | got.data[1] << 8, heard & 0xFFFF);
    assert_int_equal(heard, FRAMES);
    assert_int_equal(counts().sent, FRAMES);
    assert_int_equal(counts().send_dropped, 0);
    assert_true(stats().client_lost > 0);
    assert_true(longest_ns < INT64_C(1000000000)); /* a blocking send would never return */
    /* What the slow one does get is in order, whole, and then it is served again. */
    unsigned slow_heard = 0;
    for (; hears(&slow, &got); slow_heard++)
        assert_int_equal(got.length, 4);
    assert_int_equal(slow_heard + stats().client_lost, FRAMES);
    tcp_peer_close(&slow);
    tcp_peer_close(&quick);
}

static void too_many_clients_are_turned_away(void **state) {
    (void)state;
    struct tcp_peer peers[KL_SOCKETCAND_CLIENTS];
    struct tcp_peer extra;
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++)
        assert_true(tcp_peer_join(&peers[i], &can, port(), 0));
    assert_true(tcp_peer_connect(&extra, port(), 0));
    assert_true(tcp_peer_expect(&extra, &can, "< error too many clients >"));
    assert_int_equal(tcp_peer_read(&extra), 0);
    assert_int_equal(stats().turned_away, 1);
    tcp_peer_close(&extra);
    tcp_peer_close(&peers[3]);
    serve(5);
    assert_true(tcp_peer_join(&extra, &can, port(), 0)); /* the place is free again */
    tcp_peer_close(&extra);
    for (int i = 0; i < KL_SOCKETCAND_CLIENTS; i++)
        tcp_peer_close(&peers[i]);
}

/* ---- bad clients ---- */

static void bad_lines_are_counted_once_each(void **state) {
    (void)state;
    static const char *const lines[] = {"< send 123 4  >", "< frob >", "hello", "< send 123 1 ",
                                        "< send 123 0 > junk"};
    static const unsigned bad[] = {1, 1, 1, 0, 2}; /* the unfinished one counts with the next < */
    struct tcp_peer peer;
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    uint64_t refused = 0;
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++) {
        assert_true(say(&peer, lines[i]));
        serve(5);
        refused += bad[i];
        assert_int_equal(counts().refused, refused);
    }
    struct kl_can_frame got;
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_OK); /* the one good line */
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_EMPTY);
    tcp_peer_close(&peer);
}

static void longest_line_passes_and_a_longer_one_does_not(void **state) {
    (void)state;
    struct tcp_peer peer;
    struct kl_can_frame got;
    char line[KL_SOCKETCAND_LINE_BYTES + 4];
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    for (size_t extra = 0; extra < 2; extra++) {
        memset(line, ' ', sizeof line);
        line[0] = '<';
        memcpy(line + 2, "send 77 0", 9);
        line[KL_SOCKETCAND_LINE_BYTES + 1 + extra] = '>';
        assert_true(tcp_peer_say(&peer, line, KL_SOCKETCAND_LINE_BYTES + 2 + extra));
        serve(5);
        assert_int_equal(kl_can_receive(&can, &got), extra == 0 ? KL_CAN_OK : KL_CAN_EMPTY);
    }
    assert_int_equal(counts().refused, 1);
    tcp_peer_close(&peer);
}

/* Clients that vanish in every stage, in the middle of lines, with data on the way to them. */
static void vanishing_clients_do_no_harm(void **state) {
    (void)state;
    const struct kl_can_frame frame = {.id = 0x123, .length = 8};
    const struct linger reset = {.l_onoff = 1, .l_linger = 0};
    signal(SIGPIPE, SIG_DFL); /* as a program that never thought of it */
    for (int kind = 0; kind < 40; kind++) {
        struct tcp_peer peer;
        if (kind % 4 == 0) {
            assert_true(tcp_peer_connect(&peer, port(), 0));
        } else {
            assert_true(tcp_peer_join(&peer, &can, port(), 0));
        }
        for (int i = 0; i < kind; i++)
            (void)kl_can_send(&can, &frame);
        if (kind % 3 != 0)
            assert_true(say(&peer, "< send 12"));
        if (kind % 2 != 0)
            setsockopt(peer.socket, SOL_SOCKET, SO_LINGER, &reset, sizeof reset);
        if (kind % 5 != 0)
            kl_can_service(&can);
        tcp_peer_close(&peer);
        for (int i = 0; i < 20; i++) {
            (void)kl_can_send(&can, &frame);
            kl_can_service(&can);
        }
    }
    serve(10);
    assert_int_equal(stats().clients, 0);
    assert_int_equal(stats().streaming, 0);
    assert_true(stats().accepted >= 30);
    assert_int_equal(counts().refused, 0); /* no half line of one client became another's */
    struct tcp_peer peer;
    struct kl_can_frame got;
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    assert_int_equal(kl_can_send(&can, &frame), KL_CAN_OK);
    assert_true(hears(&peer, &got));
    tcp_peer_close(&peer);
}

/* Gone before its questions are answered: the second answer meets a closed connection. */
static void answers_to_the_dead_do_not_kill(void **state) {
    (void)state;
    struct tcp_peer peer;
    signal(SIGPIPE, SIG_DFL);
    for (int i = 0; i < 20; i++) {
        assert_true(tcp_peer_join(&peer, &can, port(), 0));
        assert_true(say(&peer, "< echo >< echo >< echo >< echo >"));
        tcp_peer_close(&peer);
        serve(3);
    }
    assert_int_equal(stats().clients, 0);
}

static void late_commands_are_read_by_receive_itself(void **state) {
    (void)state;
    struct tcp_peer peer;
    struct kl_can_frame got;
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    kl_can_service(&can);
    assert_true(say(&peer, "< send 42 0 >"));
    test_sleep_us(5000);
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_OK);
    assert_int_equal(got.id, 0x42);
    tcp_peer_close(&peer);
}

static void flood_from_a_client_is_bounded_and_counted(void **state) {
    (void)state;
    struct tcp_peer peer;
    struct kl_can_frame got;
    assert_true(tcp_peer_join(&peer, &can, port(), 0));
    for (int i = 0; i < 5000; i++) {
        assert_true(say(&peer, "< send 1 0 >"));
        if (i % 50 == 0)
            kl_can_service(&can);
    }
    serve(100);
    struct kl_can_counts now = counts();
    assert_int_equal(now.receive_dropped, 5000 - KL_SOCKETCAND_QUEUE);
    for (unsigned i = 0; i < KL_SOCKETCAND_QUEUE; i++)
        assert_int_equal(kl_can_receive(&can, &got), KL_CAN_OK);
    assert_int_equal(kl_can_receive(&can, &got), KL_CAN_EMPTY);
    tcp_peer_close(&peer);
}

int main(void) {
#define CASE(name) cmocka_unit_test_setup_teardown(name, start, stop)
    const struct CMUnitTest tests[] = {
        CASE(port_in_use_is_told),
        CASE(the_port_is_free_again_at_once),
        CASE(arguments_are_checked),
        CASE(streaming_waits_for_the_quiet_time),
        CASE(handshake_in_single_bytes),
        CASE(wrong_order_gets_an_error),
        CASE(only_the_channel_there_is),
        CASE(without_clients_frames_go_nowhere),
        CASE(clients_hear_the_owner_and_each_other),
        CASE(slow_client_loses_and_the_others_do_not),
        CASE(too_many_clients_are_turned_away),
        CASE(bad_lines_are_counted_once_each),
        CASE(longest_line_passes_and_a_longer_one_does_not),
        CASE(vanishing_clients_do_no_harm),
        CASE(answers_to_the_dead_do_not_kill),
        CASE(late_commands_are_read_by_receive_itself),
        CASE(flood_from_a_client_is_bounded_and_counted),
    };
    return cmocka_run_group_tests_name("kl_socketcand", tests, NULL, NULL);
}
