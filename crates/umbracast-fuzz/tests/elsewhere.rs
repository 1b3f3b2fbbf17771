//! Alone in its program, because panics of other threads are all the same to whoever checks an input.

use umbracast_fuzz::Target;
use umbracast_fuzz::run::checked;

#[test]
fn a_panic_of_another_thread_breaks_a_promise_too() {
    static ELSEWHERE: Target = Target {
        name: "elsewhere",
        corpus: || vec![vec![1]],
        check: |_| std::thread::spawn(|| panic!("in the server")).join().is_err(),
    };
    let (_, story) = checked(&ELSEWHERE, 0, &[1]).expect_err("a panic");
    assert_eq!(story, "in the server");
}
