-- SPDX-License-Identifier: BSD-3-Clause
-- Purpose: a first look at the AXI top, for `fusesoc run --target=sim`: is it there, does it refuse what it must, do
-- the gates switch when enabled, does the telemetry come, does a trip end it.  Ends with "passed", or with a failure
-- that says what was wrong.  The numbers are proven elsewhere (cocotb_tests/).

library ieee;
use ieee.std_logic_1164.all;
use ieee.numeric_std.all;
use std.env.finish;

entity fluxproof_axi_tb is
end entity fluxproof_axi_tb;

architecture sim of fluxproof_axi_tb is
  constant PERIOD       : time                         := 10 ns;
  constant CARRIER_HALF : positive                     := 128;
  constant OKAY         : std_logic_vector(1 downto 0) := "00";
  constant SLVERR       : std_logic_vector(1 downto 0) := "10";
  constant DECERR       : std_logic_vector(1 downto 0) := "11";

  signal aclk           : std_logic;
  signal aresetn        : std_logic;
  signal s_axi_awaddr   : std_logic_vector(11 downto 0);
  signal s_axi_awvalid  : std_logic;
  signal s_axi_awready  : std_logic;
  signal s_axi_wdata    : std_logic_vector(31 downto 0);
  signal s_axi_wvalid   : std_logic;
  signal s_axi_wready   : std_logic;
  signal s_axi_bresp    : std_logic_vector(1 downto 0);
  signal s_axi_bvalid   : std_logic;
  signal s_axi_araddr   : std_logic_vector(11 downto 0);
  signal s_axi_arvalid  : std_logic;
  signal s_axi_arready  : std_logic;
  signal s_axi_rdata    : std_logic_vector(31 downto 0);
  signal s_axi_rresp    : std_logic_vector(1 downto 0);
  signal s_axi_rvalid   : std_logic;
  signal m_axis_tvalid  : std_logic;
  signal m_axis_tlast   : std_logic;
  signal sample_trigger : std_logic;
  signal sample_valid   : std_logic;
  signal trip           : std_logic;
  signal gate_high      : std_logic_vector(2 downto 0);
  signal gate_low       : std_logic_vector(2 downto 0);
  signal irq            : std_logic;
  signal packets        : natural;
  signal edges          : natural;
begin

  clock : process
  begin
    aclk <= '0';
    wait for PERIOD / 2;
    aclk <= '1';
    wait for PERIOD / 2;
  end process;

  dut : entity work.fluxproof_axi
    generic map (
      CLOCK_HZ     => 100000000,
      CARRIER_HALF => CARRIER_HALF
    )
    port map (
      aclk           => aclk,
      aresetn        => aresetn,
      s_axi_awaddr   => s_axi_awaddr,
      s_axi_awprot   => "000",
      s_axi_awvalid  => s_axi_awvalid,
      s_axi_awready  => s_axi_awready,
      s_axi_wdata    => s_axi_wdata,
      s_axi_wstrb    => "1111",
      s_axi_wvalid   => s_axi_wvalid,
      s_axi_wready   => s_axi_wready,
      s_axi_bresp    => s_axi_bresp,
      s_axi_bvalid   => s_axi_bvalid,
      s_axi_bready   => '1',
      s_axi_araddr   => s_axi_araddr,
      s_axi_arprot   => "000",
      s_axi_arvalid  => s_axi_arvalid,
      s_axi_arready  => s_axi_arready,
      s_axi_rdata    => s_axi_rdata,
      s_axi_rresp    => s_axi_rresp,
      s_axi_rvalid   => s_axi_rvalid,
      s_axi_rready   => '1',
      m_axis_tdata   => open,
      m_axis_tvalid  => m_axis_tvalid,
      m_axis_tready  => '1',
      m_axis_tlast   => m_axis_tlast,
      sample_trigger => sample_trigger,
      sample_valid   => sample_valid,
      adc_a          => x"8000",
      adc_b          => x"8000",
      adc_c          => x"8000",
      adc_u_dc       => x"8000",
      position_code  => x"0000",
      trip           => trip,
      gate_high      => gate_high,
      gate_low       => gate_low,
      irq            => irq
    );

  -- The converters: codes ten clocks after the trigger
  converters : process
  begin
    sample_valid <= '0';
    wait until rising_edge(aclk) and sample_trigger = '1';
    for k in 1 to 10 loop
      wait until rising_edge(aclk);
    end loop;
    sample_valid <= '1';
    wait until rising_edge(aclk);
  end process;

  count : process (aclk)
  begin
    if rising_edge(aclk) then
      if m_axis_tvalid = '1' and m_axis_tlast = '1' then
        packets <= packets + 1;
      end if;
      assert (gate_high and gate_low) = "000" or aresetn = '0'
        report "both gates of a leg are on"
        severity failure;
    end if;
  end process;

  -- Edges of leg a's upper gate
  switching : process (gate_high(0))
  begin
    if gate_high(0)'event and gate_high(0)'last_value = '0' then
      edges <= edges + 1;
    end if;
  end process;

  stimuli : process
    procedure write_word (address : natural; data : integer; wanted : std_logic_vector(1 downto 0) := OKAY) is
    begin
      s_axi_awaddr  <= std_logic_vector(to_unsigned(address, 12));
      s_axi_wdata   <= std_logic_vector(to_signed(data, 32));
      s_axi_awvalid <= '1';
      s_axi_wvalid  <= '1';
      wait for 1 ns;
      while s_axi_awvalid = '1' or s_axi_wvalid = '1' loop
        wait until rising_edge(aclk);
        if s_axi_awready = '1' then
          s_axi_awvalid <= '0';
        end if;
        if s_axi_wready = '1' then
          s_axi_wvalid <= '0';
        end if;
        wait for 1 ns;
      end loop;
      while s_axi_bvalid /= '1' loop
        wait until rising_edge(aclk);
        wait for 1 ns;
      end loop;
      assert s_axi_bresp = wanted
        report "write to " & to_hstring(to_unsigned(address, 12)) & " was answered with " & to_string(s_axi_bresp)
        severity failure;
      wait until rising_edge(aclk);
    end procedure;

    procedure read_word (address : natural; wanted : std_logic_vector(1 downto 0) := OKAY) is
    begin
      s_axi_araddr  <= std_logic_vector(to_unsigned(address, 12));
      s_axi_arvalid <= '1';
      wait until rising_edge(aclk) and s_axi_arready = '1';
      s_axi_arvalid <= '0';
      while s_axi_rvalid /= '1' loop
        wait until rising_edge(aclk);
        wait for 1 ns;
      end loop;
      assert s_axi_rresp = wanted
        report "read of " & to_hstring(to_unsigned(address, 12)) & " was answered with " & to_string(s_axi_rresp)
        severity failure;
    end procedure;

    procedure expect (condition : boolean; otherwise : string) is
    begin
      assert condition
        report otherwise
        severity failure;
    end procedure;
  begin
    aresetn       <= '0';
    s_axi_awvalid <= '0';
    s_axi_wvalid  <= '0';
    s_axi_arvalid <= '0';
    trip          <= '0';
    wait for 20 * PERIOD;
    aresetn       <= '1';
    wait until rising_edge(aclk);

    read_word(16#000#);
    expect(s_axi_rdata = x"464C5558", "identification is not FLUX");
    read_word(16#010#);
    expect(to_integer(unsigned(s_axi_rdata)) = CARRIER_HALF, "carrier_half cannot be read back");
    read_word(16#3F0#, OKAY);
    write_word(16#3F0#, 1, DECERR);
    write_word(16#000#, 1, SLVERR);
    write_word(16#170#, 4096, SLVERR);

    -- A drive at rest: dead time, minimum pulse, a gain for the bus, limits out of the way; telemetry on
    write_word(16#170#, 4);
    write_word(16#174#, 10);
    write_word(16#11C#, 65536);
    write_word(16#17C#, 16#7FFF#);
    write_word(16#04C#, 1);
    read_word(16#170#);
    expect(to_integer(unsigned(s_axi_rdata)) = 4, "dead_time cannot be read back");
    wait for 4 * CARRIER_HALF * PERIOD;
    expect(edges = 0 and gate_high = "000" and gate_low = "000", "gates moved before enable");

    write_word(16#040#, 1);
    wait for 24 * CARRIER_HALF * PERIOD;
    expect(edges >= 10, "gates do not switch");
    expect(packets >= 8, "no telemetry");
    read_word(16#080#);
    expect(s_axi_rdata(1 downto 0) = "01", "not running, or tripped");

    wait until gate_low(0) = '1';
    wait for 3 ns;
    trip <= '1';
    wait for 1 ns;
    expect(gate_high = "000" and gate_low = "000", "a trip waits for the clock");
    trip <= '0';
    wait for 8 * CARRIER_HALF * PERIOD;
    expect(gate_high = "000" and gate_low = "000" and irq = '1', "a trip is forgotten");
    write_word(16#044#, 1);
    write_word(16#06C#, 15);
    wait for 8 * CARRIER_HALF * PERIOD;
    expect(irq = '0' and (gate_low'last_event < 4 * CARRIER_HALF * PERIOD), "no gate after clear_trip");

    report "passed";
    finish;
  end process;

end architecture sim;
