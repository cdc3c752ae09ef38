//! Describing function of the jets' pulse modulation: gain and phase for a sinusoidal command of a
//! given amplitude and frequency. `cargo run --release -p reentry-control --example
//! describing_function`

use control::allocation::Settings;

fn main() {
    let pwpf = Settings::published().pwpf;
    let frequencies = [0.5, 1.0, 2.0, 4.0, 8.0];
    println!("duty     {}", frequencies.map(|w| format!("{w:>6.1} rad/s   ")).join(""));
    for amplitude in [0.11, 0.15, 0.2, 0.3, 0.5, 0.7, 1.0] {
        let cells = frequencies.map(|frequency| {
            let (gain, phase) = pwpf.describing_function(amplitude, frequency);
            format!("{gain:>6.3} {:>6.1}° ", phase.to_degrees())
        });
        println!("{amplitude:<8} {}", cells.join(" "));
    }
}
