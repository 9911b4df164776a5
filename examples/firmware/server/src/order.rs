//! How sequence numbers follow each other.

use epipole_wire::{Order, Statistics};

/// A number so little behind is late; farther behind, the sender has started again.
const LATE: u16 = 64;

/// Watches the numbers of the requests.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sequence {
    /// None before the first request.
    next: Option<u16>,
}

impl Sequence {
    /// Takes the number of a request that arrived whole, and counts what it tells.
    pub(crate) fn take(&mut self, number: u16, statistics: &mut Statistics) -> Order {
        let Some(next) = self.next else {
            self.next = Some(number.wrapping_add(1));
            return Order::Next;
        };
        let ahead = number.wrapping_sub(next);
        let behind = next.wrapping_sub(number);
        let order = match () {
            () if ahead == 0 => Order::Next,
            () if behind <= LATE => Order::Late,
            () if ahead < 1 << 15 => Order::Gap,
            () => Order::Restart,
        };
        match order {
            Order::Next => (),
            Order::Gap => statistics.missed = statistics.missed.wrapping_add(u32::from(ahead)),
            Order::Late => statistics.late = statistics.late.wrapping_add(1),
            Order::Restart => statistics.restarted = statistics.restarted.wrapping_add(1),
        }
        if order != Order::Late {
            self.next = Some(number.wrapping_add(1));
        }
        order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_followed_across_the_wrap() {
        let mut statistics = Statistics::default();
        let mut sequence = Sequence::default();
        let orders = [65533, 65534, 0, 65535, 1, 1, 5, 60000, 60001, 100]
            .map(|number| sequence.take(number, &mut statistics));
        use Order::{Gap, Late, Next, Restart};
        assert_eq!(orders, [Next, Next, Gap, Late, Next, Late, Gap, Restart, Next, Gap]);
        // 65535, then 2, 3, 4, then 60002..=65535 and 0..=99.
        assert_eq!((statistics.missed, statistics.late, statistics.restarted), (1 + 3 + 5534 + 100, 2, 1));
    }
}
